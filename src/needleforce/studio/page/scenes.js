// SPDX-License-Identifier: Apache-2.0
// What the simulator's drawings show of { trace, models, presets, chosen, cursor, lowest, deepest }: the scenes of plot.js
// and section.js, and the legend of a picture. The cursor is the step that the reader looks at, or null.

import { tipOutline } from "./tip.js";
import { PARTS, STEP } from "./trace.js";

export const NAMES = ["A", "B"]; // of the models

const colourOf = (colour, k) => (k ? colour.b : colour.a);

/** The runs that there are, each with the number of its model. */
export const runsOf = (trace) => trace.runs.map((run, k) => run && { run, k }).filter(Boolean);

/** Where an event is in the curves: a puncture is reported by the first step after the fall, and is shown before it. */
export function eventPlace(trace, { run }, { at: step, kind }) {
  const i = kind === "punctured" ? Math.max(0, step - 1) : step;
  return { depth: 1e3 * trace.depth[i], time: trace.time[i], force: run.columns.force[i] };
}

function forceRange(trace) {
  let [low, high] = [0, 0.05];
  for (const { run } of runsOf(trace))
    for (let i = 0; i < trace.length; ++i) {
      const force = run.columns.force[i];
      if (force < low) low = force;
      if (force > high) high = force;
    }
  return { label: "force [N]", low: low - 0.06 * (high - low), high: high + 0.14 * (high - low) };
}

/** The parts of the chosen model below the force of each. */
function curves({ trace, chosen }, colour, x, scaleX) {
  const curve = (run, name, more) => ({ x, y: run.columns[name], length: trace.length, scaleX, ...more });
  const parts = PARTS.map((name) => curve(trace.runs[chosen], name, { colour: colour[name], width: 1.2 }));
  const force = ({ run, k }) => curve(run, "force", { colour: colourOf(colour, k), width: 2.2, dash: k ? [7, 4] : [] });
  return [...parts, ...runsOf(trace).map(force)];
}

function marks({ trace, models }, colour, x) {
  return runsOf(trace).flatMap((one) => one.run.events.map((event) => {
    const place = eventPlace(trace, one, event);
    const text = event.kind === "punctured" ? `puncture${models[1] ? ` ${NAMES[one.k]}` : ""}` : "";
    return { x: place[x], y: place.force, text, onLeft: Boolean(models[1]) && one.k === 0, colour: colourOf(colour, one.k) };
  }));
}

function cursorOn({ trace, cursor }, colour, x) {
  if (cursor === null) return null;
  return { x: x(cursor), points: runsOf(trace).map(({ run, k }) => ({ y: run.columns.force[cursor], colour: colourOf(colour, k) })) };
}

export function depthScene(shown, colour) {
  const { trace, lowest, deepest } = shown;
  return {
    x: { label: "depth [mm]", low: 1e3 * lowest, high: 1e3 * deepest }, y: forceRange(trace),
    curves: curves(shown, colour, trace.depth, 1e3), marks: marks(shown, colour, "depth"),
    cursor: cursorOn(shown, colour, (i) => 1e3 * trace.depth[i]),
  };
}

export function timeScene(shown, colour) {
  const { trace, chosen } = shown;
  const { phases } = trace.runs[chosen];
  const bands = phases.map(({ from, phase }, i) => (
    { from: from * STEP, to: (phases[i + 1]?.from ?? trace.length) * STEP, text: phase }));
  return {
    x: { label: "time [s]", low: 0, high: Math.max(4, trace.length * STEP) }, y: forceRange(trace), bands,
    curves: curves(shown, colour, trace.time, 1), marks: marks(shown, colour, "time"),
    cursor: cursorOn(shown, colour, (i) => trace.time[i]),
  };
}

/** The curves of a picture by name and colour, for which the page has its table. */
export function drawLegend(context, { height }, colour, { models, chosen }) {
  const forces = models.map((model, k) => model && [`force ${NAMES[k]}: ${model.preset}`, colourOf(colour, k)]).filter(Boolean);
  const of = forces.length > 1 ? ` ${NAMES[chosen]}` : "";
  let left = 0;
  context.textAlign = "left";
  context.textBaseline = "middle";
  for (const [text, style] of [...forces, ...PARTS.map((name) => [name + of, colour[name]])]) {
    context.fillStyle = style;
    context.fillRect(left, height / 2 - 1, 16, 3);
    context.fillStyle = colour.ink;
    context.fillText(text, left + 22, height / 2);
    left += 50 + context.measureText(text).width;
  }
}

export function sectionScene({ trace, models, presets, chosen, cursor, lowest, deepest }) {
  const now = cursor ?? trace.length - 1;
  const { layers, preset } = models[chosen];
  const punctured = trace.runs[chosen].events.filter(({ at, kind }) => kind === "punctured" && at <= now).length;
  let most = trace.depth[0];
  for (let i = 0; i <= now; ++i) if (trace.depth[i] > most) most = trace.depth[i];
  const tip = tipOutline(layers[0].stiffness, presets[preset].needle);
  return { low: lowest, high: deepest, depth: trace.depth[now], deepest: most, layers, punctured, tip };
}
