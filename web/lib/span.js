// What a slider goes over: from end to end by equal steps, or by equal factors where the ends are far apart.

const FAR = 90; // times: from there on a slider of equal steps would leave its lower decades no room
const STEPS = 1000;
const DIGITS = 3; // of a number that a logarithmic slider gives

// {min, max, isLog, step, stepAt(value)}, and where it is logarithmic toShare(value) and fromShare(share), shares being
// 0..1. From 0 the lowest part is linear, up to about 1.
export function span({ min, max }, step, mayBeLog) {
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
    stepAt: (value) => 10 ** (Math.floor(Math.log10(Math.max(Math.abs(value), min, 1e-3)) + 1e-9) - 1),
  };
}

// The ends of a field whose range depends on another one's choice; those of its slider where nothing is said of that.
export function endsOf({ ranges, soft }, choice) {
  const own = ranges?.bounds[choice];
  return own ? { min: own[0], max: own[1] } : soft;
}
