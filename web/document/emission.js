// What emits light.

const brightest = (value) => (Array.isArray(value) ? Math.max(...value) : value);

// Whether a shape of the scene emits light.
export const isLamp = ({ materials }, { material }) => brightest(materials[material]?.emission) > 0;
