import { lightModels, shapeModels } from "../server/schema.js";

// New things: [{title, kind, make(camera, radius, material)}], in the middle of what is looked at, and lights, which have
// `shines` in the place of `make`: their type; `carries`: all things stand on it.
export function additions(schema) {
  const shapes = shapeModels(schema);
  const lights = lightModels(schema);
  const near = ({ target }) => target.map((x) => Number(x.toFixed(3)));
  const all = [
    {
      title: "Sphere",
      kind: "shapes",
      needs: shapes.sphere,
      make: (c, r, material) => ({ type: "sphere", center: near(c), radius: r, material }),
    },
    {
      title: "Box",
      kind: "shapes",
      needs: shapes.box,
      make: (c, r, material) => ({
        type: "box",
        min: near(c).map((x) => x - r),
        max: near(c).map((x) => x + r),
        material,
      }),
    },
    {
      title: "Quad",
      kind: "shapes",
      needs: shapes.quad,
      make: (c, r, material) => ({
        type: "quad",
        origin: near(c).map((x, i) => x + [-r, 0, r][i]),
        u: [2 * r, 0, 0],
        v: [0, 0, -2 * r],
        material,
      }),
    },
    {
      title: "Disk",
      kind: "shapes",
      needs: shapes.disk,
      make: (c, r, material) => ({ type: "disk", center: near(c), normal: [0, 1, 0], radius: r, material }),
    },
    {
      title: "Cylinder",
      kind: "shapes",
      needs: shapes.cylinder,
      make: (c, r, material) => {
        const [x, y, z] = near(c);
        return { type: "cylinder", base: [x, y - r, z], axis: [0, 2 * r, 0], radius: r, material };
      },
    },
    { title: "Ground", needs: shapes.quad, carries: true },
    { title: "Area light", kind: "shapes", needs: shapes.quad, shines: "quad" },
    { title: "Disk light", kind: "shapes", needs: shapes.disk, shines: "disk" },
    { title: "Tube light", kind: "shapes", needs: shapes.cylinder, shines: "cylinder" },
    { title: "Sphere light", kind: "shapes", needs: shapes.sphere, shines: "sphere" },
    { title: "Point light", kind: "lights", needs: lights.point, shines: "point" },
    { title: "Spot light", kind: "lights", needs: lights.spot, shines: "spot" },
    { title: "Sun", kind: "lights", needs: lights.directional, shines: "directional" },
  ];
  return all.filter(({ needs }) => needs);
}
