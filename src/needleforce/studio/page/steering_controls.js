// SPDX-License-Identifier: Apache-2.0
// The fields of the steered needle: where its base is, with a button to either side of each number, and where target and
// obstacles are. What is not a number in range never leaves its field.

import { element } from "./controls.js";

const DEGREES = 180 / Math.PI;
/** The coordinates of the base in the units shown: how far a button moves them, and between what. */
export const COORDINATES = {
  depth: { label: "depth", unit: "mm", factor: 1e3, by: 1, low: -5, high: 120 },
  x: { label: "across, x", unit: "mm", factor: 1e3, by: 0.5, low: -15, high: 15 },
  y: { label: "across, y", unit: "mm", factor: 1e3, by: 0.5, low: -15, high: 15 },
  roll: { label: "roll", unit: "°", factor: DEGREES, by: 10, low: -3600, high: 3600 },
  tiltX: { label: "tilt in x", unit: "°", factor: DEGREES, by: 1, low: -10, high: 10 },
  tiltY: { label: "tilt in y", unit: "°", factor: DEGREES, by: 1, low: -10, high: 10 },
};
const SPOT = { low: -100, high: 200 }, RADIUS = { low: 0.1, high: 30 }; // [mm]

const shown = (value, places = 2) => (value + 0).toFixed(places).replace(/^-(?=[0.]*$)/, "").replace("-", "−");
const given = (text) => (text.trim() ? Number(text.trim().replace(",", ".").replace("−", "-")) : NaN);

/** The number of a field if it is one in range; else the reason goes to `refuse`. */
function taken(input, name, unit, { low, high }, refuse) {
  const value = given(input.value);
  const right = value >= low && value <= high;
  input.setAttribute("aria-invalid", String(!right));
  refuse(right ? "" : `${name}: “${input.value}” is not a number from ${shown(low, 1)} to ${shown(high, 1)} ${unit}.`);
  return right ? value : null;
}

/** Fills a place with the base's coordinates. `onGo` takes a name and its value, `onBy` a name and a change; SI. */
export function showBase(place, onGo, onBy, refuse) {
  place.replaceChildren(...Object.entries(COORDINATES).map(([name, one]) => {
    const input = element("input", { type: "text", id: `steer-${name}`, inputMode: "decimal", autocomplete: "off" });
    input.addEventListener("input", () => { input.dataset.written = ""; });
    input.addEventListener("change", () => {
      delete input.dataset.written;
      const value = taken(input, one.label, one.unit, one, refuse);
      if (value !== null) onGo(name, value / one.factor);
    });
    const button = (text, way) => {
      const made = element("button", { type: "button", id: `steer-${name}-${way < 0 ? "less" : "more"}`,
        "aria-label": `${one.label} ${way < 0 ? "less" : "more"} by ${one.by} ${one.unit}` }, text);
      made.addEventListener("click", () => onBy(name, (way * one.by) / one.factor));
      return made;
    };
    return element("div", { className: "place" }, element("label", { for: input.id }, one.label),
      button("−", -1), input, button("+", 1), element("span", { className: "unit" }, one.unit));
  }));
}

/** The base's numbers where the reader does not write. */
export function refreshBase(base) {
  for (const [name, { factor }] of Object.entries(COORDINATES)) {
    const input = document.getElementById(`steer-${name}`);
    if (!("written" in input.dataset) && input.getAttribute("aria-invalid") !== "true") input.value = shown(factor * base[name]);
  }
}

/** Fills a place with target and obstacles; `onChange` takes them after a field did. */
export function showSpots(place, target, obstacles, onChange, refuse) {
  const field = (spot, name, i, change) => {
    const axis = ["x", "y", "depth", "radius"][i];
    const input = element("input", { type: "text", inputMode: "decimal", autocomplete: "off", value: shown(1e3 * spot[i], 1),
      id: `steer-${name.replace(" ", "-")}-${axis}`, "aria-label": `${name}, ${axis} in mm` });
    input.addEventListener("change", () => {
      const value = taken(input, `${name}, ${axis}`, "mm", i === 3 ? RADIUS : SPOT, refuse);
      if (value !== null) change(spot.with(i, value / 1e3));
    });
    return input;
  };
  const row = (spot, name, change, ...more) => element("div", { className: "spot" }, element("span", {}, name),
    ...spot.map((_, i) => field(spot, name, i, change)), ...more);
  const remove = (k) => {
    const made = element("button", { type: "button", "aria-label": `remove obstacle ${k + 1}` }, "×");
    made.addEventListener("click", () => onChange(target, obstacles.toSpliced(k, 1)));
    return made;
  };
  place.replaceChildren(
    row(target, "target", (next) => onChange(next, obstacles)),
    ...obstacles.map((one, k) => row(one, `obstacle ${k + 1}`, (next) => onChange(target, obstacles.with(k, next)), remove(k))),
  );
}
