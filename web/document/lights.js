// A row for each kind of light that is no shape:
//   make(stand)         a new one: {position, direction, radius, distance, power}: how wide what it is aimed at is, and
//                       how far away; power(factor) is the strength that is needed there, times a factor
//   strength            the name of the field that holds it
//   units(light)        lm, cd or lx for a strength of 1 W/sr or W/m², over NITS
//   isSharp             its shadows are sharp

// The angles of a spot's beam that is as wide as what it is aimed at, in degrees.
function beamAround(radius, distance) {
  const angle = Math.min(60, (Math.atan2(radius, distance) * 180) / Math.PI);
  return { inner_angle: Number(angle.toPrecision(2)), outer_angle: Number((1.4 * angle).toPrecision(2)) };
}

// From the axis of a beam to its edge: the solid angle that it fills evenly, in sr.
function beam({ inner_angle: inner, outer_angle: outer }) {
  const [a, b] = [inner, outer].map((angle) => Math.cos((angle * Math.PI) / 180));
  return 2 * Math.PI * (1 - (a + b) / 2);
}

export const LIGHTS = {
  point: {
    make: ({ position, distance, power }) => ({ type: "point", position, intensity: power(distance * distance) }),
    strength: "intensity",
    units: () => ({ lm: 4 * Math.PI, cd: 1 }),
    isSharp: true,
  },
  spot: {
    make: ({ position, direction, radius, distance, power }) => ({
      type: "spot",
      position,
      direction,
      ...beamAround(radius, distance),
      intensity: power(distance * distance),
    }),
    strength: "intensity",
    units: (light) => ({ lm: beam(light), cd: 1 }),
    isSharp: true,
  },
  directional: {
    make: ({ direction, power }) => ({
      type: "directional",
      direction,
      irradiance: power(1),
      angular_diameter: 0.53,
    }),
    strength: "irradiance",
    units: () => ({ lx: 1 }),
  },
};
