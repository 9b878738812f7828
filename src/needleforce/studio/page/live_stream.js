// SPDX-License-Identifier: Apache-2.0
// What the server streams of a run: its state, and points for the plots, never more than a limit. Each message is
// answered while a run is in progress, so that the recorder knows that a page looks on.

const KEPT = 12000; // points
const STRETCH = 4; // points of which two remain
const ANSWERED_EVERY = 400, RETRIED_AFTER = 1000; // [ms]
export const BUSY = ["starting", "running", "stopping"];

/** The points of a run in columns, and how many readings they stand for. */
export class Trace {
  constructor() {
    this.clear();
  }

  clear() {
    Object.assign(this, { time: [], depth: [], force: [], model: [], readings: 0 });
  }

  get length() {
    return this.time.length;
  }

  add(points, readings) {
    this.readings += readings;
    for (const [time, depth, force, model] of points) {
      this.time.push(time);
      this.depth.push(depth ?? NaN);
      this.force.push(force);
      this.model.push(model ?? NaN);
    }
    if (this.length > KEPT) this.reduce();
  }

  /** Of each stretch the lowest and the highest force remain. */
  reduce() {
    const kept = [];
    for (let start = 0; start < this.length; start += STRETCH) {
      let [low, high] = [start, start];
      for (let i = start; i < Math.min(start + STRETCH, this.length); ++i) {
        if (this.force[i] < this.force[low]) low = i;
        if (this.force[i] > this.force[high]) high = i;
      }
      kept.push(...[...new Set([low, high])].sort((a, b) => a - b));
    }
    for (const name of ["time", "depth", "force", "model"]) this[name] = kept.map((i) => this[name][i]);
  }
}

/** Sends an order to the server: its answer, or an error in words; no answer at all is thrown. */
export async function order(action, asked) {
  const options = { method: "POST", body: asked === undefined ? undefined : JSON.stringify(asked) };
  const answer = await fetch(`live/${action}`, options);
  if (answer.status === 403) throw new Error(await answer.text());
  return answer.json();
}

/** Listens until the page is closed. `onMessage(message)`, and `onLost()` while the server does not answer. */
export function listen(onMessage, onLost) {
  let answered = 0;
  const source = new EventSource("live/stream");
  source.addEventListener("message", ({ data }) => {
    const message = JSON.parse(data);
    onMessage(message);
    if (!BUSY.includes(message.state) || performance.now() - answered < ANSWERED_EVERY) return;
    answered = performance.now();
    order("alive").catch(() => {});
  });
  source.addEventListener("error", () => {
    onLost();
    source.close(); // a browser gives up after some answers; this page does not
    setTimeout(() => listen(onMessage, onLost), RETRIED_AFTER);
  });
}
