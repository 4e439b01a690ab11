// Small pictures for kinds of things and for what is done with them, drawn in the colour of the text around them.

const ICONS = {
  more: "M2.5 6.7a1.3 1.3 0 1 1 0 2.6 1.3 1.3 0 0 1 0-2.6m5.5 0a1.3 1.3 0 1 1 0 2.6 1.3 1.3 0 0 1 0-2.6m5.5 0a1.3 1.3 0 1 1 0 2.6 1.3 1.3 0 0 1 0-2.6",
  stop: "M4 4h8v8H4z",
  remove: "M6 1.5h4l.7 1.3H14v1.4H2V2.8h3.3zM3 5.3h10l-.7 9.2H3.7z",
  camera: "M2 5h2.5l1-1.5h5l1 1.5H14v8H2zm6 1.6a2.3 2.3 0 1 0 0 4.6 2.3 2.3 0 0 0 0-4.6",
  environment: "M8 1.5a6.5 6.5 0 1 1 0 13 6.5 6.5 0 0 1 0-13M2.8 8h10.4v1H2.8z",
  group: "M1.5 3h4.6l1.4 1.7h7v8.3h-13z",
  shown:
    "M8 3.5c3.2 0 5.6 2 6.8 4.5-1.2 2.5-3.6 4.5-6.8 4.5S2.4 10.5 1.2 8C2.4 5.5 4.8 3.5 8 3.5m0 1.8a2.7 2.7 0 1 0 0 5.4 2.7 2.7 0 0 0 0-5.4",
  hidden:
    "M2.2 1.2 14.8 13.8l-1 1L11 12c-.9.3-1.900.5-3 .5-3.2 0-5.6-2-6.8-4.5.6-1.3 1.5-2.4 2.6-3.2L1.2 2.2zM8 3.5c3.2 0 5.6 2 6.8 4.5-.5 1-1.100 1.900-1.900 2.6L6.2 3.7A8 8 0 0 1 8 3.5",
  free: "M4 7h5V4.5a1.5 1.5 0 0 1 3 0V6h1.5V4.5a3 3 0 0 0-6 0V7H3v7h9V7z",
  locked: "M4.5 7V4.5a3.5 3.5 0 0 1 7 0V7H13v7H3V7zM6 7h4V4.5a2 2 0 0 0-4 0z",
  light: "M8 1.5A4.5 4.5 0 0 1 10.5 9.7V12h-5V9.7A4.5 4.5 0 0 1 8 1.5M6 13h4v1.5H6z",
  sphere: "M8 2a6 6 0 1 1 0 12A6 6 0 0 1 8 2",
  box: "m8 1.5 5.8 3v7L8 14.5l-5.8-3v-7z",
  quad: "M4.5 4H15l-3.5 8H1z",
  disk: "M8 4.2c3.700 0 6.700 1.700 6.700 3.800s-3 3.800-6.700 3.800S1.300 10.100 1.300 8s3-3.800 6.700-3.800",
  mesh: "M8 1.5 14.5 14h-13zM8 5.2 4.3 12.4h7.4z",
};

export const icon = (name) => drawn(ICONS[name] ?? ICONS.mesh);

// One of another outline, in a square of 16.
export function drawn(outline) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  path.setAttribute("d", outline);
  path.setAttribute("fill-rule", "evenodd");
  svg.append(path);
  return svg;
}
