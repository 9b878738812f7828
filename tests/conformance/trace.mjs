// SPDX-License-Identifier: Apache-2.0
// The conformance set through WebAssembly; README.md says what a case is. In Node the first argument is needleforce.mjs,
// the others are the cases; in_browser.py imports `trace` into a page.
const FAMILIES = ["stiffness", "puncture", "friction", "cutting", "relaxation"];
const PARTS = ["depth", "velocity", "force", "stiffness", "friction", "cutting", "lateral", "force_by_depth",
  "force_by_velocity"];
let Insertion, CondensedInsertion, FlexibleInsertion;
const said = [];

const ODD = { nan: NaN, inf: Infinity, "-inf": -Infinity };
const number = (word) => ODD[word] ?? Number(word);
const velocityOf = (word) => (word === "-" ? null : number(word));
const text = (value) => (Object.is(value, -0) ? "-0" : String(value));

/** A law or tip: `NAME {NUMBER VALUE}`. */
function named([name, ...words]) {
  const one = { name };
  for (let i = 0; i < words.length; i += 2)
    one[words[i]] = words[i] === "equivalence" ? words[i + 1] : number(words[i + 1]);
  return one;
}

/** A lateral layer: `TOP {NUMBER VALUE} form NAME`. */
function lateral([top, ...words]) {
  const layer = { top: number(top) };
  for (let i = 0; i < words.length; i += 2)
    layer[words[i]] = words[i] === "form" ? words[i + 1] : number(words[i + 1]);
  return layer;
}

/** A solid: `SPACING NODES SCALE FALL`. */
function solid([spacing, length, scale, fall]) {
  const row = (_, i) => Array.from({ length }, (_, j) => scale / (1 + fall * ((i - j) * (i - j))));
  return { spacing, compliance: Array.from({ length }, row) };
}

class Case {
  layers = [];
  settings = {};
  bending = { lateral: [], sections: [] };
  ticks = 0;
  base = [0, 0, 0, 0, 0]; // of a needle that bends: x, y, tilts, roll

  /** True for a line of the model. */
  describe(what, words) {
    const layer = this.layers.at(-1);
    if (what === "layer") this.layers.push({ top: number(words[0]) });
    else if (what === "set") this.settings[words[0]] = number(words[1]);
    else if (FAMILIES.includes(what)) layer[what] = named(words);
    else if (what === "tip") layer.stiffness.tip = named(words);
    else if (what === "knot") this.knot(layer.stiffness.tip, ...words.map(number));
    else if (what === "solid") this.tissue = solid(words.map(number));
    else if (what === "lateral") this.bending.lateral.push(lateral(words));
    else if (what === "section") this.section(...words.map(number));
    else if (what === "bending") this.bending[words[0]] = number(words[1]);
    else return false;
    return true;
  }
  knot(tip, radius, height) {
    tip.radii = [...(tip.radii ?? []), radius];
    tip.heights = [...(tip.heights ?? []), height];
  }
  section(end, stiffness, curvature) {
    this.bending.sections.push({ end, stiffness, curvature });
  }
  engine() {
    const { layers, tissue, bending, settings } = this;
    if (bending.lateral.length > 0) return new FlexibleInsertion(layers, { ...bending, tissue }, settings);
    return tissue ? new CondensedInsertion(tissue, layers, settings) : new Insertion(layers, settings);
  }
  make() {
    try {
      this.insertion = this.engine();
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.insertion = null;
      said.push("refused");
    }
  }
  move(what, words) {
    if (this.insertion === undefined) this.make();
    if (this.insertion === null) return;
    if (what === "at") this.ticks = Number(words[0]);
    if (what === "go") this.go(...words);
    if (what === "step") this.step(number(words[0]), velocityOf(words[1]), number(words[2]));
    if (what === "carry") this.carry(...words);
    if (what === "base") this.bend(words.map(number));
    if (what === "shape") this.insertion.shape().forEach((point) => said.push(["point", ...point.map(text)].join(" ")));
    if (what === "nodes") this.nodes(this.insertion);
    if (what === "reset") this.insertion.reset();
    if (what === "keep") this.kept = this.insertion.snapshot();
    if (what === "restore") this.restore(this.kept);
    if (what === "alter") this.restore(this.kept.map((byte, i) => (i === Number(words[0]) ? byte ^ 1 : byte)));
  }
  nodes(solid) {
    said.push(`tip ${text(solid.tip)}`);
    const displacements = solid.displacements();
    solid.nodeForces().forEach((force, i) => said.push(`node ${text(force)} ${text(displacements[i])}`));
  }
  restore(bytes) {
    said.push(this.insertion.restore(bytes) ? "taken" : "refused");
  }
  go(n, dt, velocity, ...travels) {
    for (let i = 0; i < Number(n); ++i) {
      this.ticks += Number(travels[i % travels.length]);
      this.step(this.ticks * 2 ** -30, velocityOf(velocity), number(dt));
    }
  }
  carry(n, dt, ...travels) {
    for (let i = 0; i < Number(n); ++i) {
      this.ticks += Number(travels[0]);
      this.base = this.base.map((ticks, k) => ticks + Number(travels[k + 1]));
      this.bend([...[this.ticks, ...this.base].map((ticks) => ticks * 2 ** -30), number(dt)]);
    }
  }
  bend([depth, x, y, tiltX, tiltY, roll, dt]) {
    const s = this.insertion.step({ depth, lateral: [x, y], tilt: [tiltX, tiltY], roll }, dt);
    this.print(s.axial);
    const numbers = [...s.tip, ...s.tangent, ...s.wrench, s.force, s.lateral, s.unsupported];
    said.push(["bent", ...numbers.map(text), s.status, Number(s.buckled)].join(" "));
  }
  step(depth, velocity, dt) {
    this.print(this.insertion.step(depth, velocity, dt));
  }
  print(sample) {
    const events = [sample.contact, sample.punctured, sample.exit].map(Number);
    said.push([...PARTS.map((part) => text(sample[part])), sample.phase, sample.status, ...events].join(" "));
  }
}

/** What the core of `module` gives for the cases, { path: text }. */
export async function trace(module, cases) {
  ({ Insertion, CondensedInsertion, FlexibleInsertion } = await (await import(module)).load());
  said.length = 0;
  for (const [path, content] of Object.entries(cases)) {
    said.push(`case ${path}`);
    const one = new Case();
    for (const line of content.split("\n")) {
      const [what, ...words] = line.split(" ").filter((word) => word !== "");
      if (what && what[0] !== "#" && !one.describe(what, words)) one.move(what, words);
    }
  }
  return `${said.join("\n")}\n`;
}

if (typeof process !== "undefined") {
  const { readFileSync } = await import("node:fs");
  const { pathToFileURL } = await import("node:url");
  const [module, ...paths] = process.argv.slice(2);
  const cases = Object.fromEntries(paths.map((path) => [path, readFileSync(path, "utf8")]));
  process.stdout.write(await trace(pathToFileURL(module).href, cases));
}
