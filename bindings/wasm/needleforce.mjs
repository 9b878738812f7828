// SPDX-License-Identifier: Apache-2.0
/**
 * The force of a needle in soft tissue, one control cycle at a time: the C++ core as WebAssembly, in Node and in
 * browsers. SI units; force is + when it opposes insertion, depth + inwards from the undeformed surface.
 *
 *     import { load } from "./needleforce.mjs";
 *     const { Insertion } = await load();
 *     const hand = new Insertion([{
 *       top: 0,
 *       stiffness: { name: "cone", reduced_modulus: 116e3, half_angle: 0.26 },
 *       puncture: { name: "puncture_depth", depth: 3.2e-3 },
 *       friction: { name: "coulomb", per_length: 18.6 },
 *       cutting: { name: "constant_cutting", force: 0.0776 },
 *     }]);
 *     hand.step(1e-3, null, 1e-3).force;
 */

const FAMILIES = ["stiffness", "puncture", "friction", "cutting", "relaxation"];
const NO_VELOCITY = Number.MAX_VALUE;
const PARTS = ["depth", "velocity", "force", "stiffness", "friction", "cutting", "lateral", "force_by_depth",
  "force_by_velocity"];

async function bytesOf(source) {
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return source;
  if (new URL(source).protocol === "file:" && typeof process !== "undefined") {
    const { readFile } = await import("node:fs/promises");
    return readFile(new URL(source));
  }
  return (await fetch(source)).arrayBuffer();
}

/**
 * Compiles the core, once. `source`: the place of needleforce.wasm, or its bytes; the default is this file's folder.
 * Gives `{ Insertion, version }`.
 */
export async function load(source = new URL("needleforce.wasm", import.meta.url)) {
  const module = await WebAssembly.compile(await bytesOf(source));
  return { Insertion: insertionOf(module), version: new Core(module).text("version") };
}

/** One instance of the core, with texts. */
class Core {
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
}

function refuse(what, value, why) {
  throw new RangeError(`${what} (${value}) ${why}`);
}

function giveNumbers(core, numbers, where) {
  for (const [name, value] of Object.entries(numbers)) {
    if (typeof value !== "number") refuse(`${where}.${name}`, value, "is not a number");
    if (!core.calls.give(core.put(name), value)) refuse(`${where}.${name}`, value, "is one parameter too many");
  }
}

function giveTip(core, { name, equivalence, radii = [], heights = [], ...numbers }) {
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

function insertionOf(module) {
  /** A needle going in and out of up to eight layers, as `nf_insertion` in needleforce.h. */
  return class Insertion {
    #core;
    #numbers;
    #words;
    #names;

    /**
     * `layers` from the surface down: `{ top, stiffness, puncture, friction, cutting, relaxation }`, each law
     * `{ name, ...parameters }` with those left out at their defaults; `tip_contact` has a `tip` of the same form.
     * `settings`: those of `nf_settings`. Throws a RangeError with what was refused, and why.
     */
    constructor(layers, settings = {}) {
      const core = (this.#core = new Core(module));
      core.calls.begin();
      giveSettings(core, settings);
      layers.forEach((layer) => giveLayer(core, layer));
      if (!core.calls.make()) this.#explain();
      const { buffer } = core.calls.memory;
      const at = core.calls.sample_at();
      this.#numbers = new Float64Array(buffer, at, PARTS.length);
      this.#words = new Int32Array(buffer, at + 8 * PARTS.length, 5);
      const named = (call, n) => Array.from({ length: n }, (_, i) => core.text(call, i));
      this.#names = { phase: named("phase_name", 5), status: named("status_name", 4) };
    }
    #explain() {
      const [law, quantity, reason] = [0, 1, 2].map((i) => this.#core.text("fault_text", i));
      const [layer, value] = [0, 1].map((i) => this.#core.calls.fault_number(i));
      refuse(`layer ${layer + 1}, ${law} ${quantity}`, value, reason);
    }

    /** One cycle: depth [m], velocity [m/s] or null for the change of depth, dt [s]. Never throws. */
    step(depth, velocity, dt) {
      this.#core.calls.step(depth, velocity ?? NO_VELOCITY, dt);
      const sample = {};
      for (let i = 0; i < PARTS.length; ++i) sample[PARTS[i]] = this.#numbers[i];
      const [phase, status, contact, punctured, exit] = this.#words;
      sample.phase = this.#names.phase[phase];
      sample.status = this.#names.status[status];
      return Object.assign(sample, { contact: contact === 1, punctured: punctured === 1, exit: exit === 1 });
    }
    /** Back to before the first contact. */
    reset() {
      this.#core.calls.reset();
    }
    /** The memory as bytes. */
    snapshot() {
      const { calls } = this.#core;
      calls.save();
      return new Uint8Array(calls.memory.buffer, calls.snapshot_at(), calls.snapshot_size()).slice();
    }
    /** Takes a memory back; false, and nothing changes, for bytes of another version or model, or altered ones. */
    restore(bytes) {
      const { calls } = this.#core;
      const size = calls.snapshot_size();
      if (bytes.length !== size) return false;
      new Uint8Array(calls.memory.buffer, calls.snapshot_at(), size).set(bytes);
      return calls.restore(size) === 1;
    }
  };
}
