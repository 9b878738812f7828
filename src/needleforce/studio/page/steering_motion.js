// SPDX-License-Identifier: Apache-2.0
// One motion of a needle's base in steps of a millisecond, and what the core gives along it. Steps that the core does not
// accept, several after each other, end the motion: the base is then where it was before them.

export const STEP = 1e-3; // [s]
export const MAX_STEPS = 240_000; // four minutes
export const BASE = ["depth", "x", "y", "tiltX", "tiltY", "roll"];
export const RESULTS = ["tipX", "tipY", "tipZ", "force", "lateral", "fx", "fy", "fz", "mx", "my", "mz"];
const COLUMNS = [...BASE, ...RESULTS];
const SPEED = { depth: 0.02, x: 0.02, y: 0.02, tiltX: 0.2, tiltY: 0.2, roll: 3 }; // [m/s], [rad/s] where none is given
const PATIENCE = 20; // refused steps after which the motion ends; a single one without an equilibrium is passed
const NODE = 1e-4; // [m] of travel between two points of the path

const longer = (column) => {
  const next = new Float64Array(2 * column.length);
  next.set(column);
  return next;
};

export class SteeredMotion {
  /** `insertion`: of a needle that bends. It begins at a depth [m], its base in the middle. */
  constructor(insertion, start) {
    this.insertion = insertion;
    this.columns = Object.fromEntries(COLUMNS.map((name) => [name, new Float64Array(1024)]));
    this.statuses = []; // { at, status, buckled } of the steps that were not accepted
    this.length = 0;
    this.here = Object.fromEntries(BASE.map((name) => [name, name === "depth" ? start : 0]));
    this.sample = null; // the last that was accepted
    this.held = this.here; // the base of that
    this.refusal = null; // { status, buckled } that ended the motion, until a step is accepted
    this.path = []; // where the tip went, each [x, y, z]
    this.reached = -Infinity; // the depth of the last point of the path
    this.targets = {}; // by coordinate: { to, speed }
    this.queue = []; // of such targets, which follow each other
    this.#advance(this.here);
  }
  get isFull() {
    return this.length === MAX_STEPS;
  }
  get moves() {
    return !this.isFull && (Object.keys(this.targets).length > 0 || this.queue.length > 0);
  }
  /** Time of the last step [s]. */
  get time() {
    return STEP * (this.length - 1);
  }
  /** The base goes to values [m], [rad] at a speed [m/s], [rad/s]; the coordinates do not wait for each other. */
  go(values, speed) {
    for (const [name, to] of Object.entries(values)) this.targets[name] = { to, speed: speed ?? SPEED[name] };
  }
  /** Targets that follow each other, each `{ values, speed }`. */
  follow(targets) {
    this.queue = targets;
    this.targets = {};
  }
  stop() {
    [this.targets, this.queue] = [{}, []];
  }
  /** So many steps, or until the base has arrived. */
  run(steps) {
    for (let i = 0; i < steps && this.moves; ++i) {
      if (!Object.keys(this.targets).length) {
        const { values, speed } = this.queue.shift();
        this.go(values, speed);
      }
      this.#advance(this.#next());
    }
  }
  #next() {
    const next = { ...this.here };
    for (const [name, { to, speed }] of Object.entries(this.targets)) {
      const way = to - next[name];
      if (Math.abs(way) > speed * STEP) next[name] += Math.sign(way) * speed * STEP;
      else {
        next[name] = to;
        delete this.targets[name];
      }
    }
    return next;
  }
  #advance(base) {
    const { depth, x, y, tiltX, tiltY, roll } = base;
    const sample = this.insertion.step({ depth, lateral: [x, y], tilt: [tiltX, tiltY], roll }, STEP);
    const { tip, wrench, force, lateral } = sample;
    const numbers = [...tip, force, lateral, ...wrench];
    const accepted = sample.status === "ok" && numbers.every(Number.isFinite);
    this.#record([...BASE.map((name) => base[name]), ...(accepted ? numbers : numbers.map(() => NaN))]);
    this.here = base;
    if (!accepted) return this.#refused(sample);
    [this.held, this.sample, this.refusal] = [base, sample, null];
    if (tip[2] < 0 || depth < this.reached + NODE) return;
    this.reached = depth;
    this.path.push(tip);
  }
  #refused({ status, buckled }) {
    this.statuses.push({ at: this.length - 1, status: status === "ok" ? "not_finite" : status, buckled });
    if (this.statuses.at(-PATIENCE)?.at !== this.length - PATIENCE) return;
    this.refusal = this.statuses.at(-1);
    this.here = this.held;
    this.stop();
  }
  #record(numbers) {
    if (this.length === this.columns.depth.length)
      for (const name of COLUMNS) this.columns[name] = longer(this.columns[name]);
    COLUMNS.forEach((name, i) => { this.columns[name][this.length] = numbers[i]; });
    ++this.length;
  }
}

/** Distance of a point from the target [m]. */
export const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);

/** Distance of a path from the nearest sphere [m], negative inside, and which; infinity without one. */
export function clearanceOf(path, obstacles) {
  let [least, which] = [Infinity, -1];
  obstacles.forEach(([x, y, z, radius], k) => {
    for (const point of path) {
      const gap = apart(point, [x, y, z]) - radius;
      if (gap < least) [least, which] = [gap, k];
    }
  });
  return { least, which };
}

/** How near to the target a motion came, where its tip is, and what its path passed [m]. */
export function scoreOf(motion, target, obstacles) {
  const { path, sample } = motion;
  const whole = sample.tip[2] >= 0 ? [...path, sample.tip] : path;
  return {
    now: apart(sample.tip, target),
    nearest: whole.reduce((least, point) => Math.min(least, apart(point, target)), Infinity),
    ...clearanceOf(whole, obstacles),
  };
}

/** The targets of a plan: in each row the base moves across and rolls at rest, then the needle is pushed. */
export function movesOf(rows, speed) {
  return rows.flatMap(([depth, x, y, roll]) => [{ values: { x, y, roll } }, { values: { depth }, speed }]);
}

/** Base, tip, forces and status of each step, with every digit; SI. */
export function motionText(motion, name, version) {
  const units = { x: "base_x_m", y: "base_y_m", depth: "depth_m", tiltX: "tilt_x_rad", tiltY: "tilt_y_rad", roll: "roll_rad",
    tipX: "tip_x_m", tipY: "tip_y_m", tipZ: "tip_z_m", force: "force_N", lateral: "tip_lateral_N",
    fx: "fx_N", fy: "fy_N", fz: "fz_N", mx: "mx_Nm", my: "my_Nm", mz: "mz_Nm" };
  const refused = new Map(motion.statuses.map(({ at, status }) => [at, status]));
  const rows = [`# origin: simulated: steered needle ${name}, in the studio of needleforce ${version}`,
    ["time_s", ...COLUMNS.map((column) => units[column]), "status"].join(",")];
  for (let i = 0; i < motion.length; ++i)
    rows.push([(i * STEP).toFixed(3), ...COLUMNS.map((column) => motion.columns[column][i]), refused.get(i) ?? "ok"].join(","));
  return [...rows, ""].join("\n");
}

/** The needle's points from the base to the tip, as they are now. */
export function shapeText(motion) {
  return ["x_m,y_m,z_m", ...motion.insertion.shape().map((point) => point.join(",")), ""].join("\n");
}
