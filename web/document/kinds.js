// A row for each kind of shape and of light, in the order in which they are offered: all that lists of them show. What is
// done with them is in shapes.js and lights.js, which the page loads later.
//   title               how a new one is called
//   lamp, place, word   how it is called as a lamp, if it can be one; its place among those that are offered; the word for
//                       that kind of lamp, if it is not the type
//   isFlat              it is a floor, a wall or a panel
export const SHAPES = {
  sphere: { title: "Sphere", lamp: "Sphere light", place: 4 },
  box: { title: "Box" },
  quad: { title: "Quad", lamp: "Area light", place: 1, word: "area", isFlat: true },
  disk: { title: "Disk", lamp: "Disk light", place: 2, isFlat: true },
  cylinder: { title: "Cylinder", lamp: "Tube light", place: 3 },
  mesh: {},
};
export const LIGHTS = {
  point: { title: "Point light" },
  spot: { title: "Spot light" },
  directional: { title: "Sun" },
};

export const isFlat = ({ type }) => Boolean(SHAPES[type]?.isFlat);
export const isLight = ({ type }) => Object.hasOwn(LIGHTS, type);
