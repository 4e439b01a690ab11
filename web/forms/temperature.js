// The colour of a light: a slider of temperatures, their names, and a swatch for any other colour. Its value is a linear
// colour; what it gives is a temperature, or a linear colour.

import { hex, linear } from "../lib/color.js";
import { element } from "../lib/dom.js";
import { COLDEST, HOTTEST, NAMED, OWN, kelvinWords, parseLight, temperatureOf } from "../lib/temperature.js";
import { numberEntry, track } from "./number-controls.js";

const RAMP = 12; // colours along the slider
const STAYS = 0.005; // of a temperature: as far as rounding takes it from a named one
const NEEDED = "Write a temperature such as 2700K, or a colour such as #ffb46b.";
const nameOf = (kelvin) => NAMED.find((each) => Math.abs(each.kelvin / kelvin - 1) < STAYS);

export function temperature(field, id, events) {
  const own = {
    ...field,
    unit: "K",
    min: 1000,
    max: 40000,
    open: {},
    soft: { min: COLDEST, max: HOTTEST },
    log: COLDEST,
    step: 50,
    absent: OWN,
    write: kelvinWords,
    read: parseLight,
    needed: NEEDED,
  };
  const range = track(own, id, events);
  const entry = numberEntry(own, `${id}-entry`, events, "wide");
  entry.element.setAttribute("aria-label", `${field.title}: a temperature or a colour`);
  entry.element.title = "A temperature such as 2700K, or a colour such as #ffb46b";
  const stops = element(
    "select",
    {
      "aria-label": `${field.title}, by name`,
      onchange: () => {
        events.input(Number(stops.value));
        events.commit();
      },
    },
    element("option", { value: "" }, ""),
    ...NAMED.map(({ name, kelvin }) => element("option", { value: kelvin }, `${name} ${kelvinWords(kelvin)}`)),
  );
  stops.options[0].disabled = true;
  const swatch = element("input", {
    type: "color",
    "aria-label": `${field.title}: another colour`,
    title: "Any other colour",
    oninput: () => events.input(linear(swatch.value)),
    onchange: events.commit,
  });
  const colors = Array.from({ length: RAMP }, (_, i) => {
    const tint = linear({ kelvin: COLDEST * (HOTTEST / COLDEST) ** (i / (RAMP - 1)) });
    return hex(tint.map((x) => x / Math.max(...tint)));
  });
  range.element.classList.add("kelvin");
  range.element.style.setProperty("--ramp", `linear-gradient(to right, ${colors.join(", ")})`);
  return {
    element: element(
      "div",
      { class: "temperature" },
      element("div", { class: "slider" }, range.element, entry.element),
      element("div", { class: "named" }, swatch, stops),
      element("p", { class: "note" }, "Type a temperature, 2700K, or a colour."),
    ),
    drag: entry.drag,
    show(rgb) {
      const found = temperatureOf(rgb);
      const named = found && nameOf(found);
      const kelvin = named?.kelvin ?? found;
      range.show(kelvin);
      entry.show(kelvin);
      stops.value = named ? String(named.kelvin) : "";
      stops.options[0].textContent = kelvin ? "Between these" : "Own colour";
      range.element.setAttribute(
        "aria-valuetext",
        kelvin ? [kelvinWords(kelvin), named?.name].filter(Boolean).join(", ") : OWN,
      );
      const most = Math.max(...rgb);
      swatch.value = hex(most > 0 ? rgb.map((x) => x / most) : [1, 1, 1]);
    },
  };
}
