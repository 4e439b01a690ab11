// Directions in the shading frame (z the normal, x the tangent) for the questions that are asked of a BSDF. Angles are
// in degrees from the normal within the xz plane, positive towards +x; beyond 90 they are below the surface.

const RADIAN = Math.PI / 180;

// Distances from the mirror direction at which narrow lobes are sampled.
const NEAR_MIRROR = [0.05, 0.1, 0.2, 0.35, 0.6, 1.5, 2.5];
const LEAST_GAP = 0.02; // degrees between two directions, below which a curve is fine enough

const short = (x) => Number(x.toFixed(8)); // what single precision keeps: half the bytes on the way to the server

export const direction = (theta, phi) => [
  short(Math.sin(theta * RADIAN) * Math.cos(phi * RADIAN)),
  short(Math.sin(theta * RADIAN) * Math.sin(phi * RADIAN)),
  short(Math.cos(theta * RADIAN)),
];
export const inPlane = (degrees) => direction(degrees, 0);
export const angleOf = ([x, , z]) => Math.atan2(x, z) / RADIAN;

const sorted = (angles) => [...new Set(angles.map((x) => Number(x.toFixed(4))))].sort((a, b) => a - b);
const isGrazing = (angle) => Math.abs(Math.abs(angle) - 90) < 1e-3; // between two sides, so on neither

// Outgoing angles over the whole circle, denser round the mirror direction of light from -incidence.
export function sweep(incidence) {
  const every = Array.from({ length: 180 }, (_, i) => 2 * i - 178);
  const near = NEAR_MIRROR.flatMap((gap) => [incidence - gap, incidence + gap]);
  const edges = [-90.1, -89.9, 89.9, 90.1];
  return sorted([...every, ...near, ...edges, incidence]).filter(
    (angle) => !isGrazing(angle) && Math.abs(angle) <= 180,
  );
}

// Angles between those of a curve where its height jumps by more than `least`, at most `most` of them.
export function refined(angles, heights, least, most) {
  const jumps = [];
  for (let i = 1; i < angles.length; i += 1) {
    const jump = Math.abs(heights[i] - heights[i - 1]);
    const gap = angles[i] - angles[i - 1];
    if (jump > least && gap > LEAST_GAP) jumps.push({ jump, gap, from: angles[i - 1] });
  }
  return jumps
    .sort((a, b) => b.jump - a.jump)
    .slice(0, most)
    .flatMap(({ from, gap }) => [from + gap / 3, from + (2 * gap) / 3])
    .filter((angle) => !isGrazing(angle));
}

// The rings and spokes of a mesh over the sphere, denser round the mirror direction: {thetas, phis}.
export function meshAngles(incidence) {
  const rings = Array.from({ length: 15 }, (_, i) => 6 * (i + 1) - (i === 14 ? 0.1 : 0));
  const near = [-6, -3, -1.2, 0, 1.2, 3, 6];
  const thetas = sorted([...rings, ...near.map((gap) => incidence + gap)]).filter(
    (theta) => theta > 0.5 && theta < 89.95,
  );
  const phis = sorted([...Array.from({ length: 30 }, (_, i) => 12 * i - 180), -6, -2, 2, 6]);
  return { thetas, phis };
}

// The half and difference angles (Rusinkiewicz 1998) at an azimuth of the difference of 90 degrees: both directions
// have one angle to the normal there, cos theta = cos theta_h cos theta_d, and are apart by `apart` in azimuth.
export function ofHalf(thetaH, thetaD) {
  const [h, d] = [thetaH * RADIAN, thetaD * RADIAN];
  return {
    theta: Math.acos(Math.min(1, Math.cos(h) * Math.cos(d))) / RADIAN,
    apart: (2 * Math.atan2(Math.sin(d), Math.sin(h) * Math.cos(d))) / RADIAN,
  };
}
