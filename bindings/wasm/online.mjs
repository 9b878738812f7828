// SPDX-License-Identifier: Apache-2.0
// Parameters of a tissue while the needle moves, and the force ahead of it: `OnlineIdentifier` of load().

import { Core, EventAt, giveNumbers, giveTip, refuse } from "./pieces.mjs";

const NAMES = ["modulus", "cutting", "friction", "top", "puncture", "remainder"];
const MOST_LAYERS = 8;
const EARLIER = 161; // points
const AHEAD = 11;
const DEPTHS = ["top", "puncture_depth", "puncture_force", "remaining", "probability"];
const LEARNT = NAMES.slice(0, 3);

const learnt = ([value, sd, before]) => ({ value, sd, before });

/** Mean and standard deviation of each part of a layer; none is expected of those left out. */
function numbersOfLayer(layer, k) {
  for (const name of Object.keys(layer))
    if (!NAMES.includes(name)) refuse(`layers[${k}]`, name, `is none of ${NAMES.join(", ")}`);
  return NAMES.flatMap((name) => (layer[name] ? [layer[name].mean, layer[name].sd] : [0, 0]));
}

function numbersOfEarlier({ mean = [], sd = [], spacing = 0 } = {}) {
  for (const column of [mean, sd])
    if (spacing !== 0 && column.length !== EARLIER) refuse("earlier", column.length, `is not ${EARLIER} numbers`);
  return spacing === 0 ? [] : [...mean, ...sd];
}

function givePrior(core, { layers = [], punctures = 0, same_tissue = false, radius = 0, tip, earlier }) {
  if (layers.length > MOST_LAYERS) refuse("prior layers", layers.length, `are more than ${MOST_LAYERS}`);
  if (!(punctures >= 0 && punctures <= MOST_LAYERS)) refuse("prior punctures", punctures, `is not 0 to ${MOST_LAYERS}`);
  if (tip) {
    core.calls.add_layer(0);
    giveTip(core, tip);
  }
  const head = [radius, punctures, same_tissue ? 1 : 0, earlier?.spacing ?? 0];
  const columns = numbersOfEarlier(earlier);
  const numbers = core.numbers(core.calls.prior_at(), 4 + 2 * NAMES.length * MOST_LAYERS + 2 * EARLIER);
  numbers.set([...head, ...layers.flatMap(numbersOfLayer)]);
  numbers.set(columns, numbers.length - 2 * EARLIER);
  return layers.length;
}

export function onlineIdentifierOf(module) {
  /** Parameters and force ahead, one sample at a time, as `nf_online` in needleforce_online.h. */
  return class OnlineIdentifier {
    #core;
    #numbers;
    #flags;
    #event;
    #statuses;
    #regimes;

    /**
     * `prior`: what is expected of the tissue, or nothing: `{ layers, punctures, same_tissue, radius, tip, earlier }`
     * with layers of `{ modulus: { mean, sd }, cutting, friction, top, puncture, remainder }`, the tip as that of a
     * law, and `earlier: { spacing, mean, sd }` of 161 forces. `settings` by name, those of the EventDetector among
     * them. Throws a RangeError with what was refused.
     */
    constructor(prior = {}, settings = {}) {
      const core = (this.#core = new Core(module));
      const layers = givePrior(core, prior);
      core.calls.open_online();
      giveNumbers(core, settings, "settings");
      if (!core.calls.make_online(layers)) {
        const { layer, law, quantity, value, reason } = core.fault();
        refuse(law === "prior" ? `prior layer ${layer + 1}, ${quantity}` : quantity, value, reason);
      }
      this.#statuses = core.words("stream_status_name", 8);
      this.#regimes = core.words("regime_name", 8);
      const at = core.calls.known_at();
      this.#event = new EventAt(core, at + 8 * 66);
      this.#numbers = core.numbers(at, 66);
      this.#flags = new Int32Array(core.calls.memory.buffer, at + 8 * 14, 2);
    }

    /** One sample: force [N], depth [m], time since the one before [s]. An event as of EventDetector, or null. */
    step(force, depth, dt) {
      return this.#event.read(this.#core.calls.online_step(force, depth, dt));
    }
    /** What the last sample was worth. */
    get status() {
      return this.#statuses[this.#core.calls.online_status()];
    }
    /** What the needle does: unknown, free, contact, rupture, sliding, reversing, withdrawal or rest. */
    get regime() {
      return this.#regimes[this.#core.calls.online_regime()];
    }
    /** How many layers are pierced. */
    get pierced() {
      return this.#core.calls.online_pierced();
    }
    /** Normalised innovation squared: near 1 where the intervals hold. */
    get innovation() {
      return this.#core.calls.online_innovation();
    }
    /** Where the tissue begins [m]: `{ value, sd, before }`, the last that of the prior. */
    get surface() {
      this.#core.calls.online_surface();
      return learnt(this.#numbers.slice(15, 18));
    }
    /** What is known of a layer, 0 the first: modulus [Pa], cutting [N], friction [N/m], depths [m] of the stream. */
    layer(k) {
      this.#core.calls.online_layer(k);
      const known = Object.fromEntries(LEARNT.map((name, i) => [name, learnt(this.#numbers.slice(3 * i, 3 * i + 3))]));
      DEPTHS.forEach((name, i) => (known[name] = this.#numbers[9 + i]));
      return Object.assign(known, { touched: this.#flags[0] === 1, pierced: this.#flags[1] === 1 });
    }
    /**
     * The force over the next `travel` [m] in the direction of the last motion: `depth`, `force`, `low`, `high` of 11
     * points, `puncture_probability` in it, and `puncture_depth` of the next with `earliest` and `latest`.
     */
    ahead(travel) {
      this.#core.calls.online_ahead(travel);
      const numbers = Array.from(this.#numbers.slice(18));
      const [depth, force, low, high] = [0, 1, 2, 3].map((i) => numbers.slice(AHEAD * i, AHEAD * (i + 1)));
      const [puncture_probability, puncture_depth, earliest, latest] = numbers.slice(4 * AHEAD);
      return { depth, force, low, high, puncture_probability, puncture_depth, earliest, latest };
    }
    /** Back to before the first sample. */
    reset() {
      this.#core.calls.online_reset();
    }
    /** What was seen, as bytes. */
    snapshot() {
      return this.#core.snapshot("online_");
    }
    /** Takes it back; false, and nothing changes, for bytes of another version, prior or settings, or altered ones. */
    restore(bytes) {
      return this.#core.restore("online_", bytes);
    }
  };
}
