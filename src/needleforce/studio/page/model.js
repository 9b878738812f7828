// SPDX-License-Identifier: Apache-2.0
// A model on the page: { preset, layers }, its layers as needleforce.mjs takes them. Laws, tips and presets are those of
// tables.json, which the core's own tables give.

export const FAMILIES = ["stiffness", "puncture", "friction", "cutting", "relaxation"];
const MAX_LAYERS = 8;

export const fromPreset = (tables, preset) => ({ preset, layers: structuredClone(tables.presets[preset].layers) });

export const isChanged = (tables, { preset, layers }) =>
  JSON.stringify(layers) !== JSON.stringify(tables.presets[preset].layers);

/** A law or tip of the table at its first values, but with what `before` had of the same name. */
export function begun(tables, kinds, name, before = {}) {
  const made = { name };
  for (const { name: key, start } of kinds[name].parameters) made[key] = before[key] ?? start;
  for (const part of kinds[name].parts) {
    if (part === "tip") made.tip = before.tip ?? begun(tables, tables.tips, "cone");
    else made[part] = before[part] ?? tables.equivalences[0];
  }
  return made;
}

/** The model with one layer more, as the last, 10 mm further down; null at the limit. */
export function deeper({ preset, layers }) {
  if (layers.length === MAX_LAYERS) return null;
  const last = structuredClone(layers.at(-1));
  return { preset, layers: [...layers, { ...last, top: last.top + 10e-3 }] };
}

/** The state of the page as text for a link, and back. */
export function linkText(tables, state) {
  const own = (model) => tables.presets[model.preset].identified; // which no other page has
  const short = (model) => model && (own(model) ? { ...model, preset: "paper" } : isChanged(tables, model) ? model : { preset: model.preset });
  const bytes = new TextEncoder().encode(JSON.stringify({ ...state, models: state.models.map(short) }));
  return btoa(String.fromCharCode(...bytes)).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** Throws an Error in words for a link that was altered, or that names what this version does not have. */
export function stateOfLink(tables, text) {
  let state;
  try {
    const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (one) => one.charCodeAt(0));
    state = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
  } catch {
    throw new Error("it is not whole");
  }
  const { models, motion } = state ?? {};
  if (!Array.isArray(models) || models.length !== 2 || !models[0]) throw new Error("it has no model");
  return { models: models.map((model) => model && checkedModel(tables, model)), motion: checkedMotion(motion) };
}

const has = (object, key) => Object.hasOwn(object, key);

function checkedModel(tables, { preset, layers }) {
  if (!has(tables.presets, preset)) throw new Error(`its preset “${preset}” is not one of this version`);
  if (layers === undefined) return fromPreset(tables, preset);
  if (!Array.isArray(layers) || !layers.length || layers.length > MAX_LAYERS) throw new Error("its layers are not 1 to 8");
  return { preset, layers: layers.map((layer) => checkedLayer(tables, layer ?? {})) };
}

function checkedLayer(tables, layer) {
  if (typeof layer.top !== "number") throw new Error("a layer has no top");
  const laws = FAMILIES.map((family) => [family, checkedNamed(tables, tables.laws[family], layer[family] ?? {}, family)]);
  return { top: layer.top, ...Object.fromEntries(laws) };
}

/** Numbers outside their ranges are left to the core, which names them. */
function checkedNamed(tables, kinds, given, what) {
  if (!has(kinds, given.name)) throw new Error(`its ${what} “${given.name}” is not one of this version`);
  const made = { name: given.name };
  const { parameters, columns } = kinds[given.name];
  for (const { name } of parameters) {
    const numbers = columns ? given[name] : [given[name]];
    if (!Array.isArray(numbers) || !numbers.every(Number.isFinite)) throw new Error(`${what} ${name} is not a number`);
    made[name] = given[name];
  }
  for (const part of kinds[given.name].parts)
    made[part] = part === "tip" ? checkedNamed(tables, tables.tips, given.tip ?? {}, "tip") : String(given[part]);
  return made;
}

function checkedMotion(motion) {
  const { speed, depth } = motion ?? {};
  if (!(speed > 0 && speed <= 0.1 && depth > 0 && depth <= 0.1)) throw new Error("its motion is not one of the page");
  return { speed, depth };
}
