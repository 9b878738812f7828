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
 * `CondensedInsertion` is the same in a solid that was condensed onto the path. `FlexibleInsertion` has a needle that
 * bends, in layers or in a solid: the motion of its base in, tip, shape and forces out. `EventDetector` finds contact,
 * punctures, stops and exit in a stream of force, depth and time; `OnlineIdentifier` learns the tissue between them.
 */

import { onlineIdentifierOf } from "./online.mjs";
import { Core, EventAt, SampleAt, giveNumbers, makeInsertion, makeSolid, refuse } from "./pieces.mjs";

const NO_VELOCITY = Number.MAX_VALUE;

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
 * Gives `{ Insertion, CondensedInsertion, FlexibleInsertion, EventDetector, OnlineIdentifier, version }`.
 */
export async function load(source = new URL("needleforce.wasm", import.meta.url)) {
  const module = await WebAssembly.compile(await bytesOf(source));
  return {
    Insertion: insertionOf(module),
    CondensedInsertion: condensedInsertionOf(module),
    FlexibleInsertion: flexibleInsertionOf(module),
    EventDetector: eventDetectorOf(module),
    OnlineIdentifier: onlineIdentifierOf(module),
    version: new Core(module).text("version"),
  };
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
      return this.#core.snapshot("");
    }
    /** Takes a memory back; false, and nothing changes, for bytes of another version or model, or altered ones. */
    restore(bytes) {
      return this.#core.restore("", bytes);
    }
  };
}

function condensedInsertionOf(module) {
  /** A needle going in and out of a solid that was condensed onto its path, as `nf_solid` in needleforce_solid.h. */
  return class CondensedInsertion {
    #core;
    #sample;

    /**
     * `tissue`: `spacing` [m] of the nodes, the first at the surface, and `compliance` [m/N] between them, 2 to 64
     * rows of as many numbers, as Tissue.condense of the Python package gives it. `layers` and `settings` as for an
     * Insertion; friction needs a sliding force per length. Throws a RangeError with what was refused, and why.
     */
    constructor(tissue, layers, settings = {}) {
      this.#core = new Core(module);
      makeSolid(this.#core, tissue, layers, settings);
      this.#sample = new SampleAt(this.#core, this.#core.calls.sample_at());
    }

    /** One cycle: depth [m], velocity [m/s] or null for the change of depth, dt [s]. Never throws. */
    step(depth, velocity, dt) {
      this.#core.calls.solid_step(depth, velocity ?? NO_VELOCITY, dt);
      return this.#sample.read();
    }
    /** Where the tip is along the path, in the undeformed tissue [m]. */
    get tip() {
      return this.#core.calls.solid_tip();
    }
    /** Forces of shaft and tip on the tissue at the nodes [N]. */
    nodeForces() {
      return this.#atNodes("solid_forces");
    }
    /** Displacements of the tissue at the nodes [m]. */
    displacements() {
      return this.#atNodes("solid_displacements");
    }
    #atNodes(call) {
      const { calls } = this.#core;
      const length = calls[call]();
      return Array.from(this.#core.numbers(calls.nodes_at(), length));
    }
    /** Back to before the first contact. */
    reset() {
      this.#core.calls.solid_reset();
    }
    /** The memory as bytes. */
    snapshot() {
      return this.#core.snapshot("solid_");
    }
    /** Takes a memory back; false, and nothing changes, for bytes of another version, tissue or model, or altered. */
    restore(bytes) {
      return this.#core.restore("solid_", bytes);
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
     * `needle_length`, `guide_distance`, `bevel_length`, ... With a `tissue` as that of a CondensedInsertion, the
     * needle drags a solid along its axis. Throws a RangeError with what was refused, and why.
     */
    constructor(layers, { tissue, ...bending }, settings = {}) {
      const core = (this.#core = new Core(module));
      if (tissue) makeSolid(core, tissue, layers, settings);
      else makeInsertion(core, layers, settings);
      if (!core.calls.make_bend(giveBending(core, bending))) this.#explain();
      const { buffer } = core.calls.memory;
      const at = core.calls.bent_at();
      this.#numbers = core.numbers(at, 15);
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
      const points = this.#core.numbers(calls.points_at(), 3 * length);
      return Array.from({ length }, (_, i) => Array.from(points.subarray(3 * i, 3 * i + 3)));
    }
    /** Back to before the first contact. */
    reset() {
      this.#core.calls.bend_reset();
    }
    /** The memory as bytes. */
    snapshot() {
      return this.#core.snapshot("bend_");
    }
    /** Takes a memory back; false, and nothing changes, for bytes of another version, model or settings, or altered. */
    restore(bytes) {
      return this.#core.restore("bend_", bytes);
    }
  };
}

function eventDetectorOf(module) {
  /** Events found while a needle moves, as `nf_events` in needleforce_events.h. */
  return class EventDetector {
    #core;
    #event;
    #statuses;

    /** `settings` by name: `{ fall, share, within, false_alarms, ... }`. Throws a RangeError with what was refused. */
    constructor(settings = {}) {
      const core = (this.#core = new Core(module));
      core.calls.open_events();
      giveNumbers(core, settings, "settings");
      if (!core.calls.make_events()) {
        const { quantity, value, reason } = core.fault();
        refuse(quantity, value, reason);
      }
      this.#event = new EventAt(core, core.calls.event_at());
      this.#statuses = core.words("stream_status_name", 8);
    }

    /**
     * One sample: force [N], depth [m], time since the one before [s]. Gives null, or `{ kind, time, depth, size,
     * probability, delay }` of an event. Never throws.
     */
    step(force, depth, dt) {
      return this.#event.read(this.#core.calls.events_step(force, depth, dt));
    }
    /** What the last sample was worth. */
    get status() {
      return this.#statuses[this.#core.calls.events_status()];
    }
    /** Standard deviation of a reading now [N]. */
    get noise() {
      return this.#core.calls.events_noise();
    }
    /** Fall that would be a puncture now [N]. */
    get neededFall() {
      return this.#core.calls.events_needed_fall();
    }
    reset() {
      this.#core.calls.events_reset();
    }
    /** What was seen, as bytes. */
    snapshot() {
      return this.#core.snapshot("events_");
    }
    /** Takes it back; false, and nothing changes, for bytes of another version or settings, or altered ones. */
    restore(bytes) {
      return this.#core.restore("events_", bytes);
    }
  };
}
