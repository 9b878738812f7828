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
 *
 * `FlexibleInsertion` is the same with a needle that bends: the motion of its base in, tip, shape and forces out.
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
 * Gives `{ Insertion, FlexibleInsertion, version }`.
 */
export async function load(source = new URL("needleforce.wasm", import.meta.url)) {
  const module = await WebAssembly.compile(await bytesOf(source));
  return {
    Insertion: insertionOf(module),
    FlexibleInsertion: flexibleInsertionOf(module),
    version: new Core(module).text("version"),
  };
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
  /** The words of phases and status. */
  names() {
    const named = (call, n) => Array.from({ length: n }, (_, i) => this.text(call, i));
    return { phase: named("phase_name", 5), status: named("status_name", 4) };
  }
  /** What was refused: layer, law, quantity, value, reason. */
  fault() {
    const [law, quantity, reason] = [0, 1, 2].map((i) => this.text("fault_text", i));
    const [layer, value] = [0, 1].map((i) => this.calls.fault_number(i));
    return { layer, law, quantity, value, reason };
  }
  /** The bytes of a snapshot, which `at` and `size` name, as they are in the core's memory. */
  bytes(at, size) {
    return new Uint8Array(this.calls.memory.buffer, this.calls[at](), this.calls[size]());
  }
}

/** A sample in the core's memory, which does not move after the construction. */
class SampleAt {
  #numbers;
  #words;
  #names;
  constructor(core, at) {
    const { buffer } = core.calls.memory;
    this.#numbers = new Float64Array(buffer, at, PARTS.length);
    this.#words = new Int32Array(buffer, at + 8 * PARTS.length, 5);
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

/** The layers and settings of the axial force. */
function makeInsertion(core, layers, settings) {
  core.calls.begin();
  giveSettings(core, settings);
  layers.forEach((layer) => giveLayer(core, layer));
  if (core.calls.make()) return;
  const { layer, law, quantity, value, reason } = core.fault();
  refuse(`layer ${layer + 1}, ${law} ${quantity}`, value, reason);
}

function insertionOf(module) {
  /** A needle going in and out of up to eight layers, as `nf_insertion` in needleforce.h. */
  return class Insertion {
    #core;
    #sample;

    /**
     * `layers` from the surface down: `{ top, stiffness, puncture, friction, cutting, relaxation }`, each law
     * `{ name, ...parameters }` with those left out at their defaults; `tip_contact` has a `tip` of the same form.
     * `settings`: those of `nf_settings`. Throws a RangeError with what was refused, and why.
     */
    constructor(layers, settings = {}) {
      this.#core = new Core(module);
      makeInsertion(this.#core, layers, settings);
      this.#sample = new SampleAt(this.#core, this.#core.calls.sample_at());
    }

    /** One cycle: depth [m], velocity [m/s] or null for the change of depth, dt [s]. Never throws. */
    step(depth, velocity, dt) {
      this.#core.calls.step(depth, velocity ?? NO_VELOCITY, dt);
      return this.#sample.read();
    }
    /** Back to before the first contact. */
    reset() {
      this.#core.calls.reset();
    }
    /** The memory as bytes. */
    snapshot() {
      this.#core.calls.save();
      return this.#core.bytes("snapshot_at", "snapshot_size").slice();
    }
    /** Takes a memory back; false, and nothing changes, for bytes of another version or model, or altered ones. */
    restore(bytes) {
      const at = this.#core.bytes("snapshot_at", "snapshot_size");
      if (bytes.length !== at.length) return false;
      at.set(bytes);
      return this.#core.calls.restore(at.length) === 1;
    }
  };
}

function giveBending(core, { lateral = [], sections = [], elements = 0, ...parameters }) {
  for (const { form, ...numbers } of lateral) {
    if (!core.calls.add_lateral(core.put(form))) refuse("lateral layers", lateral.length, "are too many");
    giveNumbers(core, numbers, "lateral");
  }
  for (const { end = Infinity, stiffness, curvature = 0 } of sections)
    if (!core.calls.add_section(end, stiffness, curvature)) refuse("sections", sections.length, "are too many");
  core.calls.open_bending();
  giveNumbers(core, parameters, "bending");
  return elements;
}

function flexibleInsertionOf(module) {
  /** A needle that bends, as `nf_bend` in needleforce_bend.h. */
  return class FlexibleInsertion {
    #core;
    #numbers;
    #axial;
    #words;
    #status;

    /**
     * `layers` and `settings` as for an Insertion. `bending`: `lateral` layers from the surface down
     * `{ top, modulus, tip_force, ..., form }`; `sections` from the tip on `{ end, stiffness, curvature }`; `elements`
     * along the embedded needle, 40 if left out; and the parameters of needle, support and lengths by name:
     * `needle_length`, `guide_distance`, `bevel_length`, ... Throws a RangeError with what was refused, and why.
     */
    constructor(layers, bending, settings = {}) {
      const core = (this.#core = new Core(module));
      makeInsertion(core, layers, settings);
      if (!core.calls.make_bend(giveBending(core, bending))) this.#explain();
      const { buffer } = core.calls.memory;
      const at = core.calls.bent_at();
      this.#numbers = new Float64Array(buffer, at, 15);
      this.#axial = new SampleAt(core, at + 8 * 15);
      this.#words = new Int32Array(buffer, at + 8 * 27, 2);
      this.#status = core.names().status;
    }
    #explain() {
      const { layer, law, quantity, value, reason } = this.#core.fault();
      refuse(`${law === "lateral_layer" ? `lateral layer ${layer + 1},` : law} ${quantity}`, value, reason);
    }

    /**
     * One cycle: where the base is, depth and lateral [m], tilt and roll [rad], the last not wrapped; dt [s]. Gives
     * `tip` [m], `tangent`, `wrench` [N], [N m], `force`, `lateral` [N], `unsupported` [m], `axial` as of an
     * Insertion, `status`, `buckled`. Never throws.
     */
    step({ depth, lateral = [0, 0], tilt = [0, 0], roll = 0 }, dt) {
      this.#core.calls.bend_step(depth, lateral[0], lateral[1], tilt[0], tilt[1], roll, dt);
      const numbers = Array.from(this.#numbers);
      const [force, across, unsupported] = numbers.slice(12);
      return {
        tip: numbers.slice(0, 3),
        tangent: numbers.slice(3, 6),
        wrench: numbers.slice(6, 12),
        force,
        lateral: across,
        unsupported,
        axial: this.#axial.read(),
        status: this.#status[this.#words[0]],
        buckled: this.#words[1] === 1,
      };
    }
    /** Points [x, y, z] of the needle from the base to the tip [m]. */
    shape() {
      const { calls } = this.#core;
      const length = calls.bend_shape();
      const points = new Float64Array(calls.memory.buffer, calls.points_at(), 3 * length);
      return Array.from({ length }, (_, i) => Array.from(points.subarray(3 * i, 3 * i + 3)));
    }
    /** Back to before the first contact. */
    reset() {
      this.#core.calls.bend_reset();
    }
    /** The memory as bytes. */
    snapshot() {
      this.#core.calls.bend_save();
      return this.#core.bytes("bend_snapshot_at", "bend_snapshot_size").slice();
    }
    /** Takes a memory back; false, and nothing changes, for bytes of another version, model or settings, or altered. */
    restore(bytes) {
      const at = this.#core.bytes("bend_snapshot_at", "bend_snapshot_size");
      if (bytes.length !== at.length) return false;
      at.set(bytes);
      return this.#core.calls.bend_restore(at.length) === 1;
    }
  };
}
