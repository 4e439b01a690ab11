// What lies under a thing: where it can be set down.

const EPSILON = 1e-6; // of a box's height: a thing that stands on the ground is not below it for a rounding

// The height of what is under the middle of a box: the highest top among the others that reach under it and do not
// stand higher than its middle; where nothing lies there, the lowest foot of all others. Null without others.
export function groundUnder({ low, high }, others) {
  const middle = low.map((x, k) => (x + high[k]) / 2);
  const slack = EPSILON * (high[1] - low[1]);
  const under = others.filter(
    (each) =>
      [0, 2].every((k) => each.low[k] <= middle[k] && middle[k] <= each.high[k]) && each.high[1] <= middle[1] + slack,
  );
  if (under.length) return Math.max(...under.map((each) => each.high[1]));
  return others.length ? Math.min(...others.map((each) => each.low[1])) : null;
}
