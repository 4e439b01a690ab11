// What a slider goes over: from end to end by equal steps, or by equal factors where the ends are far apart.

const FAR = 90; // times: from there on a slider of equal steps would leave its lower decades no room
const STEPS = 1000;
const DIGITS = 3; // of a number that a logarithmic slider gives
const ZERO = 0.03; // of a slider that begins at 0 and goes on by factors: wide enough for a hand

// {min, max, isLog, step, stepAt(value)}, and where it is logarithmic toShare(value) and fromShare(share), shares being
// 0..1. From 0 the lowest part is linear, up to about 1; or it begins at `log` with a place for 0 before that.
export function span({ min, max }, step, mayBeLog, log) {
  if (log > 0 && min <= log) return decades({ min, max }, log);
  const isLog = mayBeLog && (min > 0 ? max > FAR * min : min === 0 && max > FAR);
  if (!isLog) return { min, max, isLog, step, stepAt: () => step };
  const [low, range] = min > 0 ? [Math.log(min), Math.log(max / min)] : [0, Math.log1p(max)];
  const inside = (value) => Math.min(Math.max(value, min), max);
  return {
    min,
    max,
    isLog,
    step: 1 / STEPS,
    toShare: (value) => ((min > 0 ? Math.log(inside(value)) : Math.log1p(inside(value))) - low) / range,
    fromShare: (share) =>
      inside(Number((min > 0 ? Math.exp(low + share * range) : Math.expm1(share * range)).toPrecision(DIGITS))),
    stepAt: (value) => tenth(Math.max(Math.abs(value), min, 1e-3)),
  };
}

// A step of ten in a hundred, as a power of ten.
const tenth = (value) => 10 ** (Math.floor(Math.log10(value) + 1e-9) - 1);

function decades({ min, max }, log) {
  const zero = min < log ? ZERO : 0; // the share that 0 has of the slider
  const low = zero ? log : min;
  const range = Math.log(max / low);
  const inside = (value) => Math.min(Math.max(value, low), max);
  return {
    min,
    max,
    isLog: true,
    step: 1 / STEPS,
    toShare: (value) => (zero && value < low / 2 ? 0 : zero + ((1 - zero) * Math.log(inside(value) / low)) / range),
    fromShare: (share) =>
      share < zero / 2
        ? min
        : inside(Number((low * Math.exp((Math.max(0, share - zero) / (1 - zero)) * range)).toPrecision(DIGITS))),
    stepAt: (value) => tenth(Math.max(Math.abs(value), low)),
  };
}

// The ends of a field whose range depends on another one's choice; those of its slider where nothing is said of that.
export function endsOf({ ranges, soft }, choice) {
  const own = ranges?.bounds[choice];
  return own ? { min: own[0], max: own[1] } : soft;
}
