// Small pictures for kinds of things and for what is done with them, drawn in the colour of the text around them.

const ICONS = {
  more: "M2.5 6.7a1.3 1.3 0 1 1 0 2.6 1.3 1.3 0 0 1 0-2.6m5.5 0a1.3 1.3 0 1 1 0 2.6 1.3 1.3 0 0 1 0-2.6m5.5 0a1.3 1.3 0 1 1 0 2.6 1.3 1.3 0 0 1 0-2.6",
  stop: "M4 4h8v8H4z",
  remove: "M6 1.5h4l.7 1.3H14v1.4H2V2.8h3.3zM3 5.3h10l-.7 9.2H3.7z",
  camera: "M2 5h2.5l1-1.5h5l1 1.5H14v8H2zm6 1.6a2.3 2.3 0 1 0 0 4.6 2.3 2.3 0 0 0 0-4.6",
  environment: "M8 1.5a6.5 6.5 0 1 1 0 13 6.5 6.5 0 0 1 0-13M2.8 8h10.4v1H2.8z",
  light: "M8 1.5A4.5 4.5 0 0 1 10.5 9.7V12h-5V9.7A4.5 4.5 0 0 1 8 1.5M6 13h4v1.5H6z",
  sphere: "M8 2a6 6 0 1 1 0 12A6 6 0 0 1 8 2",
  box: "m8 1.5 5.8 3v7L8 14.5l-5.8-3v-7z",
  quad: "M4.5 4H15l-3.5 8H1z",
  mesh: "M8 1.5 14.5 14h-13zM8 5.2 4.3 12.4h7.4z",
};

export function icon(name) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  path.setAttribute("d", ICONS[name] ?? ICONS.mesh);
  path.setAttribute("fill-rule", "evenodd");
  svg.append(path);
  return svg;
}
