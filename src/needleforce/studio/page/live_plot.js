// SPDX-License-Identifier: Apache-2.0
// Force over time and over depth while it is measured, with the model's, phases and events.

import { paint } from "./drawing.js";
import { drawPlot } from "./plot.js";

const SCALE = { time: 1, depth: 1e3 };
const LABEL = { time: "time [s]", depth: "depth [mm]" };
const SHORTEST = { time: 5, depth: 2 }; // of an axis, in its unit

/** Draws both plots of a trace; `phases` are { from, to, text }, `events` { kind, time, depth, force } of the whole recording. */
export function drawRun(canvases, trace, phases, events) {
  for (const [axis, canvas] of Object.entries(canvases))
    paint(canvas, (context, size, colour) => drawPlot(context, size, colour, scene(colour, axis, trace, phases, events)));
}

function limits(values, scale = 1) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low * scale, high * scale] : [0, 0];
}

function range(axis, trace) {
  const [low, high] = limits(trace[axis], SCALE[axis]);
  return { label: LABEL[axis], low, high: Math.max(high, low + SHORTEST[axis]) };
}

function forces(trace) {
  const [measured, model] = [limits(trace.force), limits(trace.model)];
  const [low, high] = [Math.min(0, measured[0], model[0]), Math.max(measured[1], model[1], 0.01)];
  return { label: "force [N]", low: low - 0.06 * (high - low), high: high + 0.12 * (high - low) };
}

function scene(colour, axis, trace, phases, events) {
  const curve = (name, style, width) =>
    ({ x: trace[axis], y: trace[name], length: trace.length, scaleX: SCALE[axis], colour: style, width });
  const known = !Number.isNaN(trace.model.at(-1) ?? NaN);
  const hasDepth = axis === "time" || !Number.isNaN(trace.depth.at(-1) ?? NaN);
  const curves = hasDepth ? [curve("force", colour.quiet, 1.2), ...(known ? [curve("model", colour.a, 2)] : [])] : [];
  return {
    x: range(axis, trace), y: forces(trace), curves, bands: axis === "time" ? phases : undefined, cursor: null,
    marks: events.map((one) => ({
      x: one[axis] * SCALE[axis], y: one.force, colour: colour.b,
      text: axis === "time" || one.kind === "puncture" ? one.kind : "", // over depth, contact and exit are one place
    })),
  };
}
