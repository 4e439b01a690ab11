import { lightModels, shapeModels } from "../server/schema.js";

// New things, in the middle of what is looked at: [{title, kind, make(camera, materials)}].
export function additions(schema) {
  const shapes = shapeModels(schema);
  const lights = lightModels(schema);
  const near = ({ target }) => target.map((x) => Number(x.toFixed(3)));
  const above = ({ target, position }) => {
    const far = Math.hypot(...target.map((x, i) => x - position[i]));
    return {
      point: target.map((x, i) => Number((x + [0.3, 0.6, 0.3][i] * far).toFixed(3))),
      strength: Number((far * far * 2).toPrecision(2)),
    };
  };
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
      title: "Point light",
      kind: "lights",
      needs: lights.point,
      make: (c) => ({ type: "point", position: above(c).point, intensity: above(c).strength }),
    },
    {
      title: "Spot light",
      kind: "lights",
      needs: lights.spot,
      make: (c) => ({
        type: "spot",
        position: above(c).point,
        direction: near(c).map((x, i) => Number((x - above(c).point[i]).toFixed(3))),
        intensity: 2 * above(c).strength,
        inner_angle: 20,
        outer_angle: 30,
      }),
    },
    {
      title: "Sun",
      kind: "lights",
      needs: lights.directional,
      make: () => ({ type: "directional", direction: [-0.4, -1, -0.5], irradiance: 3, angular_diameter: 0.53 }),
    },
  ];
  return all.filter(({ needs }) => needs);
}
