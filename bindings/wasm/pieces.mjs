// SPDX-License-Identifier: Apache-2.0
// What is given to the core piece by piece before the loop, and read from it: the calls of pieces.cpp and those that
// the kinds of insertion share.

const FAMILIES = ["stiffness", "puncture", "friction", "cutting", "relaxation"];
const PARTS = ["depth", "velocity", "force", "stiffness", "friction", "cutting", "lateral", "force_by_depth",
  "force_by_velocity"];

/** One instance of the core, with texts. */
export class Core {
  constructor(module) {
    this.calls = new WebAssembly.Instance(module, {}).exports;
    this.calls._initialize();
  }
  /** A text that stays in the core's memory. */
  put(text) {
    if (text === undefined) return 0;
    const bytes = new TextEncoder().encode(`${text}\0`);
    const at = this.calls.room(bytes.length);
    new Uint8Array(this.calls.memory.buffer).set(bytes, at);
    return at;
  }
  /** The text that a call returns. */
  text(call, ...given) {
    const start = this.calls[call](...given);
    if (start === 0) return "";
    const bytes = new Uint8Array(this.calls.memory.buffer);
    return new TextDecoder().decode(bytes.subarray(start, bytes.indexOf(0, start)));
  }
  /** The words of phases and status. */
  names() {
    return { phase: this.words("phase_name", 5), status: this.words("status_name", 4) };
  }
  words(call, length) {
    return Array.from({ length }, (_, i) => this.text(call, i));
  }
  /** What was refused: layer, law, quantity, value, reason. */
  fault() {
    const [law, quantity, reason] = [0, 1, 2].map((i) => this.text("fault_text", i));
    const [layer, value] = [0, 1].map((i) => this.calls.fault_number(i));
    return { layer, law, quantity, value, reason };
  }
  /** Numbers in the core's memory, as long as that does not grow. */
  numbers(at, length) {
    return new Float64Array(this.calls.memory.buffer, at, length);
  }
  /** The memory of an insertion as bytes; `kind` begins the names of its calls. */
  snapshot(kind) {
    this.calls[`${kind}save`]();
    return this.#kept(kind).slice();
  }
  restore(kind, bytes) {
    const at = this.#kept(kind);
    if (bytes.length !== at.length) return false;
    at.set(bytes);
    return this.calls[`${kind}restore`](at.length) === 1;
  }
  #kept(kind) {
    const { calls } = this;
    return new Uint8Array(calls.memory.buffer, calls[`${kind}snapshot_at`](), calls[`${kind}snapshot_size`]());
  }
}

/** A sample in the core's memory, which does not move after the construction. */
export class SampleAt {
  #numbers;
  #words;
  #names;
  constructor(core, at) {
    this.#numbers = core.numbers(at, PARTS.length);
    this.#words = new Int32Array(core.calls.memory.buffer, at + 8 * PARTS.length, 5);
    this.#names = core.names();
  }
  read() {
    const sample = {};
    for (let i = 0; i < PARTS.length; ++i) sample[PARTS[i]] = this.#numbers[i];
    const [phase, status, contact, punctured, exit] = this.#words;
    sample.phase = this.#names.phase[phase];
    sample.status = this.#names.status[status];
    return Object.assign(sample, { contact: contact === 1, punctured: punctured === 1, exit: exit === 1 });
  }
}

/** An event in the core's memory. */
export class EventAt {
  #numbers;
  #kinds;
  constructor(core, at) {
    this.#kinds = core.words("event_name", 7);
    this.#numbers = core.numbers(at, 5);
  }
  /** Of this kind, or null for none. */
  read(kind) {
    if (kind === 0) return null;
    const [time, depth, size, probability, delay] = this.#numbers;
    return { kind: this.#kinds[kind], time, depth, size, probability, delay };
  }
}

export function refuse(what, value, why) {
  throw new RangeError(`${what} (${value}) ${why}`);
}

export function giveNumbers(core, numbers, where) {
  for (const [name, value] of Object.entries(numbers)) {
    if (typeof value !== "number") refuse(`${where}.${name}`, value, "is not a number");
    if (!core.calls.give(core.put(name), value)) refuse(`${where}.${name}`, value, "is one parameter too many");
  }
}

/** The tip of the layer added last. */
export function giveTip(core, { name, equivalence, radii = [], heights = [], ...numbers }) {
  core.calls.choose_tip(core.put(name), core.put(equivalence));
  if (radii.length !== heights.length) refuse("heights", heights.length, `are not as many as radii, ${radii.length}`);
  radii.forEach((radius, k) => core.calls.add_knot(radius, heights[k]) || refuse("radii", radii.length, "are too many"));
  giveNumbers(core, numbers, name);
}

function giveLayer(core, { top = 0, ...laws }) {
  if (!core.calls.add_layer(top)) refuse("layers", "10 or more", "are too many");
  for (const [family, { name, tip, ...numbers }] of Object.entries(laws)) {
    const index = FAMILIES.indexOf(family);
    if (index < 0) refuse("family", family, `is none of ${FAMILIES.join(", ")}`);
    core.calls.choose_law(index, core.put(name));
    giveNumbers(core, numbers, name);
    if (tip) giveTip(core, tip);
  }
}

function giveSettings(core, settings) {
  for (const [name, value] of Object.entries(settings))
    if (!core.calls.set(core.put(name), value)) refuse("setting", name, "is not known");
}

function giveModel(core, layers, settings) {
  core.calls.begin();
  giveSettings(core, settings);
  layers.forEach((layer) => giveLayer(core, layer));
}

function refuseModel({ layer, law, quantity, value, reason }) {
  refuse(`layer ${layer + 1}, ${law} ${quantity}`, value, reason);
}

/** The layers and settings of the axial force. */
export function makeInsertion(core, layers, settings) {
  giveModel(core, layers, settings);
  if (!core.calls.make()) refuseModel(core.fault());
}

/** A row of the table, checked. */
function rowOf(row, i, length) {
  const numbers = Array.from(row ?? []);
  const where = `compliance[${i}]`;
  if (numbers.length !== length)
    refuse(where, `${numbers.length} numbers`, `is not as long as there are rows, ${length}`);
  numbers.forEach((value, j) => typeof value === "number" || refuse(`${where}[${j}]`, value, "is not a number"));
  return numbers;
}

function giveTable(core, rows) {
  if (!Array.isArray(rows)) refuse("compliance", rows, "is no array of rows");
  const at = core.calls.open_table(rows.length);
  if (at === 0) refuse("compliance", `${rows.length} rows`, "has too many");
  const table = core.numbers(at, rows.length ** 2);
  Array.from(rows).forEach((row, i) => table.set(rowOf(row, i, rows.length), i * rows.length));
}

/** The same in a solid. */
export function makeSolid(core, { spacing, compliance } = {}, layers, settings) {
  if (typeof spacing !== "number") refuse("spacing", spacing, "is not a number");
  giveModel(core, layers, settings);
  giveTable(core, compliance);
  if (core.calls.make_solid(spacing)) return;
  const fault = core.fault();
  if (fault.law !== "solid") refuseModel(fault);
  refuse(`solid ${fault.quantity}`, `${compliance.length} nodes, ${spacing} m apart`, fault.reason);
}
