// A plot as files: its numbers as CSV, its drawing as an SVG that needs no style sheet.

const STYLES = [
  "fill",
  "fill-opacity",
  "stroke",
  "stroke-width",
  "stroke-opacity",
  "stroke-dasharray",
  "stroke-linejoin",
  "opacity",
  "font-family",
  "font-size",
  "font-weight",
  "text-anchor",
];

// RFC 4180; numbers with the digits of single precision.
export function csv({ columns, rows }) {
  const cell = (value) => (typeof value === "number" ? String(Number(value.toPrecision(7))) : (value ?? ""));
  return [columns, ...rows].map((row) => row.map(cell).join(",")).join("\r\n") + "\r\n";
}

// The text of an SVG file that looks as the plot does on the page, on the page's background.
export function standalone(plot, background) {
  // In a document of its own, which loads nothing: the page's rules allow no image from within a file.
  const copy = document.implementation.createDocument(null, null).importNode(plot, true);
  const [from, to] = [plot, copy].map((root) => [root, ...root.querySelectorAll("*")]);
  from.forEach((node, i) => {
    if (node instanceof HTMLElement) return;
    const style = getComputedStyle(node);
    for (const name of STYLES)
      if (style.getPropertyValue(name)) to[i].setAttribute(name, style.getPropertyValue(name));
    to[i].removeAttribute("class");
  });
  // What a canvas shows is an image in the file.
  const canvases = [...plot.querySelectorAll("canvas")];
  [...copy.querySelectorAll("foreignObject")].forEach((box, i) => {
    const image = copy.ownerDocument.createElementNS(copy.namespaceURI, "image");
    for (const name of ["x", "y", "width", "height"]) image.setAttribute(name, box.getAttribute(name));
    image.setAttribute("href", canvases[i].toDataURL());
    box.replaceWith(image);
  });
  const paper = copy.ownerDocument.createElementNS(copy.namespaceURI, "rect");
  for (const [name, value] of Object.entries({ width: "100%", height: "100%", fill: background }))
    paper.setAttribute(name, value);
  copy.prepend(paper);
  copy.setAttribute("xmlns", copy.namespaceURI);
  return new XMLSerializer().serializeToString(copy);
}
