// SPDX-License-Identifier: Apache-2.0
// What the page gives away: a preset, a header of constants in C++, the trace as CSV, and files of them.

import { FAMILIES, isChanged } from "./model.js";
import { PARTS } from "./trace.js";

const MAX_KNOTS = 32; // of a measured profile

/** A number that TOML and C++ read as one with a fraction, to the last bit. */
const real = (value) => (Number.isInteger(value) && Math.abs(value) < 1e16 ? `${value}.0` : String(value));
const quoted = (text) => JSON.stringify(text);
const list = (texts) => `[${texts.map((text) => `\n  ${quoted(text)},`).join("")}${texts.length ? "\n" : ""}]`;

/** Name, summary and source of a model, which says whether it is still that of its preset. */
function described(tables, model) {
  const { name, summary, reference, doubts, unverified, needle_lines: needle } = tables.presets[model.preset];
  if (!isChanged(tables, model)) return { name, summary, reference, doubts, unverified, needle };
  return {
    name: `${name}_changed`, summary: `Made in the studio from the preset ${name}`,
    reference: `values chosen in the studio; those of the preset ${name} are from: ${reference}`,
    doubts: [], unverified: [], needle,
  };
}

/** The model as a preset file. */
export function presetText(tables, model) {
  const { name, summary, reference, doubts, unverified, needle } = described(tables, model);
  const head = [`name = ${quoted(name)}`, `summary = ${quoted(summary)}`, `reference = ${quoted(reference)}`,
    `doubts = ${list(doubts)}`, `unverified = ${list(unverified)}`];
  const [first, ...others] = model.layers;
  const sections = [head, ...(needle.length ? [needle] : []), ...lawSections(tables, first, "")];
  for (const layer of others)
    sections.push(["[[layers]]", `top_m = ${real(layer.top)}`], ...lawSections(tables, layer, "layers."));
  return `${sections.map((lines) => lines.join("\n")).join("\n\n")}\n`;
}

function lawSections(tables, layer, path) {
  const shown = (value) => (Array.isArray(value) ? `[${value.map(real).join(", ")}]` : real(value));
  const numbers = (kind, value) => kind.parameters.map((row) => `${row.key} = ${shown(value[row.name])}`);
  return FAMILIES.flatMap((family) => {
    const { tip, ...law } = layer[family];
    const section = [`[${path}${family}]`, `law = ${quoted(law.name)}`, ...numbers(tables.laws[family][law.name], law)];
    if (!tip) return [section];
    const kind = tables.tips[tip.name];
    const words = kind.parts.map((part) => `${part} = ${quoted(tip[part])}`);
    return [section, [`[${path}${family}.tip]`, `shape = ${quoted(tip.name)}`, ...numbers(kind, tip), ...words]];
  });
}

/** The model as a C++ header: as `needleforce export` writes it, but for the heading. */
export function headerText(tables, model, name = "studio_model") {
  const { name: from, summary, reference, doubts } = described(tables, model);
  const lines = [`${from}: ${summary}`, `Written by the studio of needleforce, version ${tables.version}.`,
    "SI units. Depth + inwards from the surface. Force + opposes insertion.",
    `Use: needleforce::Insertion insertion(${name});`, `Reference: ${reference}`,
    ...doubts.map((doubt) => `Doubt: ${doubt}`)];
  const heading = lines.map((line) => `// ${line.replaceAll(/\s+/g, " ").replaceAll("\\", "/")}`);
  const layers = model.layers.flatMap((layer, i) => [
    `{.top = ${real(layer.top)},  // m, where layer ${i + 1} begins below the undeformed surface`, " .laws = {",
    ...FAMILIES.flatMap((family) => member(tables, family, tables.laws[family][layer[family].name], layer[family]))
      .map((line) => `     ${line}`), " }},"]);
  return [...heading, "// clang-format off", "#pragma once", '#include "needleforce/insertion.hpp"', "",
    `inline constexpr needleforce::Layer ${name}[] = {`, ...layers.map((line) => `    ${line}`), "};", ""].join("\n");
}

function member(tables, name, kind, value) {
  const line = (row) => `.${row.name} = ${real(value[row.name])},  // ${row.unit}, ${row.meaning}`;
  const inner = kind.columns ? knots(value) : kind.parameters.map(line);
  for (const part of kind.parts) {
    if (part === "tip") inner.push(...member(tables, part, tables.tips[value.tip.name], value.tip));
    else inner.push(`.${part} = needleforce::tips::BevelEquivalence::${value[part]},`);
  }
  const start = `.${name} = ${kind.type}{`;
  return inner.length ? [start, ...inner.map((line) => `    ${line}`), "},"] : [`${start}},`];
}

/** The members of a measured profile; radii behind the last are endless. */
function knots({ radii, heights }) {
  const behind = Array(MAX_KNOTS - radii.length).fill("needleforce::tips::endless");
  return [`.radius = {{${[...radii.map(real), ...behind].join(", ")}}},  // m`,
    `.rise = {{${heights.map(real).join(", ")}}},  // m, height above the apex at each radius`, `.count = ${radii.length},`];
}

/** The trace of a model as a recording, which `needleforce` reads back. */
export function csvText(tables, model, trace, run) {
  const { name } = described(tables, model);
  const head = ["# signs: depth increases inwards, force is positive against insertion",
    `# origin: simulated: ${name}, in the studio of needleforce ${tables.version}`];
  const names = ["velocity", "force", ...PARTS];
  const rows = ["time_s,depth_m,velocity_m_s,force_N,stiffness_N,friction_N,cutting_N"];
  for (let i = 0; i < trace.length; ++i)
    rows.push([Number(trace.time[i].toFixed(3)), trace.depth[i], ...names.map((each) => run.columns[each][i])].join(","));
  return [...head, ...rows, ""].join("\n");
}

/** Gives the reader a file. */
export function save(name, content, type = "text/plain") {
  const blob = content instanceof Blob ? content : new Blob([content], { type });
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
