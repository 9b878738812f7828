// SPDX-License-Identifier: Apache-2.0
// The controls of a model, made from the tables: a preset, and for each layer its laws with a slider and a number for
// each parameter. What is not a number in range never leaves its control.

import { FAMILIES, begun, deeper, fromPreset } from "./model.js";

const POSITIONS = 1000;
const REACH = 100; // a slider goes to a hundredth and to a hundred times its value
const TOP = { name: "top", unit: "m", low: 0, high: 0.1, start: 0.01, factor: 1e3, shown: "mm",
  symbol: "", meaning: "depth at which the layer begins" };

export const words = (name) => name.replaceAll("_", " ");

/** An element with properties and children; a text is set as text. */
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties))
    if (key.includes("-") || key === "role" || key === "for") made.setAttribute(key, value);
    else made[key] = value;
  made.append(...children);
  return made;
}

/**
 * Fills `place` with the controls. `now` gives the model at the time of a change: a slider that moves does not make the
 * controls again. `onModel` takes the new model, and whether they have to be made again.
 */
export function showModel(place, tables, now, onModel) {
  const open = new Map([...place.querySelectorAll("details")].map((one) => [one.dataset.part, one.open]));
  const focused = place.contains(document.activeElement) ? document.activeElement.id : "";
  const { layers, preset } = now();
  place.replaceChildren(
    presetChoice(tables, preset, onModel),
    ...layers.flatMap((layer, i) => layerControls(tables, i, layers.length > 1, open, now, onModel)),
    layerButtons(now(), onModel),
  );
  if (focused) document.getElementById(focused)?.focus();
}

function presetChoice(tables, preset, onModel) {
  const { summary, reference } = tables.presets[preset];
  const select = choice("preset", Object.keys(tables.presets).sort(), preset);
  select.addEventListener("change", () => onModel(fromPreset(tables, select.value), true));
  return element("div", { className: "preset" }, element("label", { for: "preset" }, "Preset"), select,
    element("p", { className: "about" }, summary),
    element("p", { className: "about source", title: reference }, `Source: ${reference}`));
}

function choice(id, names, chosen) {
  return element("select", { id }, ...names.map((value) =>
    element("option", { value, selected: value === chosen }, words(value))));
}

function layerButtons(model, onModel) {
  const button = (text, next) => {
    const made = element("button", { type: "button", disabled: !next }, text);
    made.addEventListener("click", () => onModel(next, true));
    return made;
  };
  const fewer = model.layers.length > 1 ? { ...model, layers: model.layers.slice(0, -1) } : null;
  return element("div", { className: "layers" }, button("Add a layer", deeper(model)), button("Remove the last", fewer));
}

function layerControls(tables, i, several, open, now, onModel) {
  const id = `layer${i}`;
  const change = (part, whole) => {
    const model = now();
    const layers = model.layers.map((layer, k) => (k === i ? { ...layer, ...part } : layer));
    onModel({ ...model, layers }, whole);
  };
  const heading = several ? [element("h3", {}, `Layer ${i + 1}`)] : [];
  const top = i ? [control(`${id}-top`, TOP, now().layers[i].top, (value) => change({ top: value }))] : [];
  const families = FAMILIES.map((family) => familyControls(tables, family, id, open, () => now().layers[i][family], change));
  return [...heading, ...top, ...families];
}

function familyControls(tables, family, id, open, law, change) {
  const kinds = tables.laws[family];
  const { name, tip } = law();
  const part = `${id}-${family}`;
  const select = choice(part, Object.keys(kinds), name);
  select.setAttribute("aria-label", `law of ${family}`);
  select.addEventListener("change", () => change({ [family]: begun(tables, kinds, select.value, law()) }, true));
  const set = (values, whole) => change({ [family]: { ...law(), ...values } }, whole);
  const about = element("p", { className: "about" }, kinds[name].summary);
  const controls = [about, ...parameters(kinds[name], law(), part, set), ...(tip ? tipControls(tables, part, law, set) : [])];
  const heading = element("summary", {}, element("span", { className: `family ${family}` }, family), " ",
    element("em", {}, words(name)));
  const isOpen = open.get(part) ?? (family !== "relaxation" && id === "layer0");
  const details = element("details", { open: isOpen }, heading, select, ...controls);
  details.dataset.part = part;
  return details;
}

function tipControls(tables, part, law, set) {
  const { tip } = law();
  const select = choice(`${part}-tip`, Object.keys(tables.tips), tip.name);
  select.setAttribute("aria-label", "tip of the needle");
  select.addEventListener("change", () => set({ tip: begun(tables, tables.tips, select.value, law().tip) }, true));
  const kind = tables.tips[tip.name];
  const setTip = (values) => set({ tip: { ...law().tip, ...values } });
  const rows = kind.columns ? [profileControl(`${part}-tip-knots`, kind, tip, setTip)] : parameters(kind, tip, `${part}-tip`, setTip);
  const cones = kind.parts.map((name) => equivalenceChoice(tables, `${part}-tip-${name}`, tip[name], (cone) => setTip({ [name]: cone })));
  return [element("p", { className: "about" }, "Tip of the needle"), select, element("p", { className: "about" }, kind.summary),
    ...rows, ...cones];
}

/** As which cone a bevel touches the tissue. */
function equivalenceChoice(tables, id, chosen, onName) {
  const select = choice(id, tables.equivalences, chosen);
  select.addEventListener("change", () => onName(select.value));
  return element("div", { className: "control" }, element("label", { for: id }, "taken as the cone of"), select);
}

/** Radii and heights of a measured profile, a pair a line. */
function profileControl(id, { parameters: rows }, tip, onColumns) {
  const [radii, heights] = rows.map(({ name, factor }) => tip[name].map((value) => readable(value * factor)));
  const lines = radii.map((radius, i) => `${radius} ${heights[i]}`).join("\n");
  const area = element("textarea", { id, rows: 6, spellcheck: false, value: lines, "aria-describedby": `${id}-why` });
  const why = element("p", { className: "why", id: `${id}-why`, role: "alert" });
  area.addEventListener("change", () => {
    const pairs = area.value.trim().split(/\n+/).map((line) => line.trim().split(/[\s;]+/).map((one) => Number(one.replace(",", "."))));
    const fits = pairs.length > 1 && pairs.every((pair) => pair.length === 2 && pair.every(Number.isFinite));
    why.textContent = fits ? "" : "Each line is a radius and a height in mm, such as “0.1 0.2”, from “0 0” on; the model is unchanged.";
    area.setAttribute("aria-invalid", String(!fits));
    if (fits) onColumns(Object.fromEntries(rows.map(({ name, factor }, k) => [name, pairs.map((pair) => pair[k] / factor)])));
  });
  return element("div", { className: "control" },
    element("label", { for: id }, "radius and height above the apex, a pair a line [mm]"), area, why);
}

const parameters = (kind, values, part, set) => kind.parameters.map((row) =>
  control(`${part}-${row.name}`, row, values[row.name], (number) => set({ [row.name]: number })));

const GREEK = { alpha: "α", gamma: "γ", delta: "δ", Lambda: "Λ", rho: "ρ", sigma: "σ", tau: "τ" };

/** A symbol of the tables, such as `tau_r` or `2 E_r R`, with its index below the line. */
function symbolParts(symbol) {
  return symbol.split(/(_[A-Za-z0-9]+)/).map((part) =>
    part.startsWith("_") ? element("sub", {}, part.slice(1)) : part.replace(/[A-Za-z]+/g, (name) => GREEK[name] ?? name));
}

const readable = (value) => String(Number(value.toPrecision(5)));

/** Between places of a slider, 0 to 1, and values: by factors where the range spans decades. */
function ruler({ low, high, start }, value) {
  if (high - low <= 100 || (low < 0 && high > 0)) {
    const span = high - low <= 100 && low >= 0 && high > 1 ? [low, high] : around(low, high, value);
    return { place: (v) => (v - span[0]) / (span[1] - span[0]), value: (p) => span[0] + p * (span[1] - span[0]) };
  }
  const sign = high <= 0 ? -1 : 1;
  const [least, most] = sign > 0 ? [low, high] : [-high, -low];
  const base = Math.abs(value) || Math.abs(start) || Math.sqrt(Math.max(least, 1e-9) * most);
  const [a, b] = [Math.max(least, base / REACH), Math.min(most, base * REACH)];
  const place = (v) => (Math.abs(v) < a ? 0 : Math.log(Math.abs(v) / a) / Math.log(b / a));
  return { place, value: (p) => sign * (p === 0 && least === 0 ? 0 : a * (b / a) ** p) };
}

/** A linear range of a few times the value, within the limits. */
function around(low, high, value) {
  const reach = Math.max(4 * Math.abs(value), 0.02 * (high - low));
  return [Math.max(low, low < 0 ? -reach : 0), Math.min(high, reach)];
}

function control(id, row, value, onValue) {
  const { name, symbol, meaning, factor, shown, low, high } = row;
  let scale = ruler(row, value);
  const unit = shown && ` ${shown}`;
  const limits = `${readable(low * factor)} to ${readable(high * factor)}${unit}`;
  const slider = element("input", { type: "range", id: `${id}-slider`, min: 0, max: POSITIONS, step: 1, "aria-label": words(name) });
  const field = element("input", { type: "text", inputMode: "decimal", id, value: readable(value * factor), autocomplete: "off",
    "aria-describedby": `${id}-why` });
  const why = element("p", { className: "why", id: `${id}-why`, role: "alert" });
  const place = (now) => {
    slider.value = Math.round(POSITIONS * Math.max(0, Math.min(1, scale.place(now))));
    slider.setAttribute("aria-valuetext", `${readable(now * factor)}${unit}`);
  };
  place(value);
  slider.addEventListener("input", () => {
    const number = scale.value(slider.value / POSITIONS);
    const rounded = Math.max(low, Math.min(high, Number((number * factor).toPrecision(3)) / factor));
    field.value = readable(rounded * factor);
    why.textContent = "";
    slider.setAttribute("aria-valuetext", `${field.value}${unit}`);
    onValue(rounded);
  });
  field.addEventListener("change", () => {
    const number = field.value.trim() === "" ? NaN : Number(field.value.replace(",", ".").replace("−", "-")) / factor;
    const fits = number >= low * (1 - 1e-12 * Math.sign(low)) && number <= high * (1 + 1e-12 * Math.sign(high));
    why.textContent = fits ? "" : `“${field.value}” is not a number from ${limits}; the model is unchanged.`;
    field.setAttribute("aria-invalid", String(!fits));
    if (!fits) return;
    const within = Math.max(low, Math.min(high, number));
    scale = ruler(row, within);
    place(within);
    onValue(within);
  });
  const label = element("label", { for: id, title: `${meaning}; ${limits}` }, words(name), " ", element("i", {}, ...symbolParts(symbol)));
  return element("div", { className: "control" }, label,
    element("span", { className: "value" }, field, element("span", { className: "unit" }, shown)), slider, why);
}
