// What the picture's other layers look like, and the legend that says what their colours mean.

// A colour for each number, apart from its neighbours: hues by the golden ratio.
export function tint(index) {
  const hue = (index * 0.618034 + 0.08) % 1;
  const light = index % 2 ? 0.62 : 0.46;
  const channel = (n) => {
    const k = (n + hue * 12) % 12;
    return light - 0.6 * Math.min(light, 1 - light) * Math.max(-1, Math.min(k - 3, 9 - k, 1));
  };
  return [channel(0), channel(8), channel(4)].map((x) => Math.round(255 * x));
}

// Dark violet to yellow, rising evenly in lightness.
const HEAT = [
  [13, 8, 75],
  [106, 0, 168],
  [190, 50, 120],
  [240, 120, 60],
  [250, 200, 60],
  [252, 253, 191],
];

export function heat(t) {
  const at = Math.min(Math.max(t, 0), 1) * (HEAT.length - 1);
  const low = Math.min(Math.floor(at), HEAT.length - 2);
  return HEAT[low].map((x, i) => x + (HEAT[low + 1][i] - x) * (at - low));
}

const significant = (x) =>
  x === 0 ? "0" : Math.abs(x) >= 1e4 || Math.abs(x) < 1e-3 ? x.toExponential(1) : x.toPrecision(3);

// The least and greatest of the values that count, as a function of the pixel's index.
function extent(floats, value) {
  let [least, most] = [Infinity, 0];
  for (let i = 0; i < floats.length; i += 4) {
    const x = value(i);
    if (x > 0) {
      least = Math.min(least, x);
      most = Math.max(most, x);
    }
  }
  return least <= most ? [least, most] : [0, 0];
}

const ramp = (stops, low, high, note) => ({
  ramp: stops.map((c) => `rgb(${c.map(Math.round).join(" ")})`),
  low,
  high,
  note,
});

function depth(floats, paint) {
  const [near, far] = extent(floats, (i) => floats[i]);
  paint((i) => {
    const d = floats[i];
    const grey = d > 0 ? 255 * (1 - 0.9 * ((d - near) / (far - near || 1))) : 0;
    return [grey, grey, grey];
  });
  return ramp(
    [
      [255, 255, 255],
      [26, 26, 26],
    ],
    `${significant(near)} m`,
    `${significant(far)} m`,
    "Black: nothing is there",
  );
}

function variance(floats, paint) {
  const mean = (i) => (floats[i] + floats[i + 1] + floats[i + 2]) / 3;
  const most = extent(floats, mean)[1];
  const least = most * 1e-6; // six decades: what is calmer is as good as still
  const place = (x) => Math.log(Math.max(x, least) / least) / Math.log(1e6);
  paint((i) => (most > 0 ? heat(place(mean(i))) : [0, 0, 0]));
  return ramp(
    [0, 0.2, 0.4, 0.6, 0.8, 1].map(heat),
    `≤ ${significant(least)}`,
    significant(most),
    "(W/(m² sr))², each step is a tenfold or so",
  );
}

function ids(floats, paint, names) {
  const seen = new Set();
  paint((i) => {
    const id = Math.round(floats[i]);
    seen.add(id);
    return id ? tint(id) : [0, 0, 0];
  });
  const entries = [...seen].filter((id) => id > 0).sort((a, b) => a - b);
  return {
    swatches: entries.map((id) => ({ color: `rgb(${tint(id).join(" ")})`, text: names[id - 1] ?? `No. ${id}` })),
  };
}

// {image, legend} of a frame of numbers, four floats a pixel. `names` are those of the shapes or materials.
export function paintLayer(aov, floats, width, height, names) {
  const image = new ImageData(width, height);
  const paint = (color) => {
    for (let i = 0; i < floats.length; i += 4) {
      const [r, g, b] = color(i);
      image.data[i] = r;
      image.data[i + 1] = g;
      image.data[i + 2] = b;
      image.data[i + 3] = 255;
    }
  };
  const paints = { depth, variance, shape_id: ids, material_id: ids };
  return { image, legend: paints[aov](floats, paint, names) };
}

// Of the layers that need no numbers.
export const LEGENDS = {
  incidence: {
    swatches: [
      { color: "rgb(64 153 89)", text: "0–45°" },
      { color: "rgb(242 204 76)", text: "45–75°" },
      { color: "rgb(204 64 51)", text: "75–90°" },
    ],
    note: "The angle between the view and the surface's normal",
  },
  albedo: { note: "How much light the surface sends back" },
  normal: {
    swatches: [
      { color: "rgb(255 128 128)", text: "+X" },
      { color: "rgb(128 255 128)", text: "+Y" },
      { color: "rgb(128 128 255)", text: "+Z" },
    ],
    note: "Grey: ½ + ½ n",
  },
};
