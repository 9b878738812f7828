// SPDX-License-Identifier: Apache-2.0
// One motion of the needle in steps of a millisecond, and each model's force along it. A model that changes runs the
// whole motion again: what is seen is always one model on one motion, so that no curve jumps at the change.

export const STEP = 1e-3; // [s]
export const MAX_STEPS = 300_000; // five minutes
export const PARTS = ["stiffness", "friction", "cutting"];
const COLUMNS = ["velocity", "force", ...PARTS];
const EVENTS = ["contact", "punctured", "exit"];
const REACH = 0.02; // [s] in which a hand's needle is two thirds of the way to the hand

const longer = (column) => {
  const next = new Float64Array(2 * column.length);
  next.set(column);
  return next;
};

/** What a model gives along the motion: a column a quantity, phases and events. */
class Run {
  constructor(insertion, capacity) {
    this.insertion = insertion;
    this.columns = Object.fromEntries(COLUMNS.map((name) => [name, new Float64Array(capacity)]));
    this.phases = []; // { from, phase }: from which step on
    this.events = []; // { at, kind }
    this.refused = 0; // steps that the core did not accept
  }
  step(at, depth) {
    const sample = this.insertion.step(depth, null, STEP);
    for (const name of COLUMNS) this.columns[name][at] = sample[name];
    if (this.phases.at(-1)?.phase !== sample.phase) this.phases.push({ from: at, phase: sample.phase });
    for (const kind of EVENTS) if (sample[kind]) this.events.push({ at, kind });
    if (sample.status !== "ok") ++this.refused;
  }
  grow() {
    for (const name of COLUMNS) this.columns[name] = longer(this.columns[name]);
  }
}

export class Trace {
  /** `insertions`: one for each model, null for none. */
  constructor(insertions, start) {
    this.start = start;
    this.time = new Float64Array(1024);
    this.depth = new Float64Array(1024);
    this.length = 0;
    this.runs = insertions.map((insertion) => insertion && new Run(insertion, 1024));
    this.advance(start);
  }
  get here() {
    return this.depth[this.length - 1];
  }
  get isFull() {
    return this.length === MAX_STEPS;
  }
  /** One step to a depth [m]. */
  advance(depth) {
    if (this.isFull) return;
    if (this.length === this.depth.length) {
      [this.time, this.depth] = [this.time, this.depth].map(longer);
      for (const run of this.runs) run?.grow();
    }
    const at = this.length++;
    this.time[at] = at * STEP;
    this.depth[at] = depth;
    for (const run of this.runs) run?.step(at, depth);
  }
  /** Steps of a needle that a hand draws towards a depth [m], no faster than it may [m/s]. */
  follow(target, steps, speed) {
    for (let i = 0; i < steps; ++i) {
      const way = target - this.here;
      const travel = Math.max(-speed * STEP, Math.min(speed * STEP, (way / REACH) * STEP));
      this.advance(Math.abs(way) < 1e-7 ? target : this.here + travel);
    }
  }
  /** Another model on the same motion; null for none. */
  replace(k, insertion) {
    const run = insertion && new Run(insertion, this.depth.length);
    for (let at = 0; run && at < this.length; ++at) run.step(at, this.depth[at]);
    this.runs[k] = run;
  }
}

/** Depths of a stroke in steps: down to `depth` with a trapezium of speed, a hold of a second, and back. */
export function* stroke(start, depth, speed, acceleration = 10e-3) {
  const length = depth - start;
  const peak = Math.min(speed, Math.sqrt(length * acceleration));
  const rise = peak / acceleration;
  const total = length / peak + rise;
  const travelled = (t) => {
    if (t >= total) return length;
    const [early, late] = [Math.min(t, rise), Math.max(0, t - (total - rise))];
    return 0.5 * acceleration * (early * early - late * late) + peak * Math.max(0, t - rise);
  };
  const steps = Math.ceil(total / STEP);
  for (let i = 1; i <= steps; ++i) yield start + travelled(i * STEP);
  for (let i = 0; i < 1 / STEP; ++i) yield depth;
  for (let i = 1; i <= steps; ++i) yield depth - travelled(i * STEP);
}
