// SPDX-License-Identifier: Apache-2.0
// The plots of a recording: force and model over depth and time, and below each what the model leaves of the force. One
// cursor is on all of them; a column of plots shares its range.

import { colours, paint } from "./drawing.js";
import { sampleAt, within } from "./events.js";
import { drawPlot, mapping } from "./plot.js";
import { Range, drawBox, listenToZoom, zoomed } from "./zoom.js";

const SCALE = { depth: 1e3, time: 1 };
const LABEL = { depth: "depth [mm]", time: "time [s]" };
const NEAR = 11; // [pixels] from a mark that is taken by the pointer
const at = (id) => document.getElementById(id);

let shown = null; // { curve, events, onMove } of the recording
let cursor = null, held = null, box = null; // sample looked at; event that is moved; { id, from, to } of a zoom
const ranges = { depth: new Range(), time: new Range() };
const PLOTS = ["depth", "time"].flatMap((axis) => [
  { id: `recorded-${axis}`, axis, ranges: { x: ranges[axis], y: new Range() }, scene: forceScene },
  { id: `residual-${axis}`, axis, ranges: { x: ranges[axis], y: null }, scene: residualScene },
]);

/** Shows a recording, whole if it is another one; `onMove` takes the number of an event and its new time. */
export function showPlots(curve, events, onMove) {
  if (shown?.curve !== curve) {
    for (const plot of PLOTS) plot.ranges.x.part = null;
    for (const { ranges: { y } } of PLOTS) if (y) y.part = null;
    cursor = null;
  }
  shown = curve && { curve, events, onMove };
  drawPlots();
}

/** The time of the sample that is looked at last, or of the highest force. */
export function timeOfInterest() {
  const { curve } = shown;
  return curve.time[lastLookedAt ?? curve.force.indexOf(Math.max(...curve.force))];
}
let lastLookedAt = null;

export function drawPlots() {
  if (!shown) return;
  for (const { id, axis, ranges: looked, scene } of PLOTS) {
    at(id).parentElement.hidden = id.startsWith("residual") && !shown.curve.model;
    paint(at(id), (context, size, colour) => {
      drawPlot(context, size, colour, zoomed(scene(colour, axis), looked));
      if (box?.id === id) drawBox(context, colour, box);
    });
  }
}

function range(values, more) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) if (value !== null) [low, high] = [Math.min(low, value), Math.max(high, value)];
  const room = high - low || 1;
  return { low: low - more[0] * room, high: high + more[1] * room };
}

function axisOf(axis) {
  const { low, high } = range(shown.curve[axis], [0, 0]);
  return { label: LABEL[axis], low: low * SCALE[axis], high: (high > low ? high : low + 1) * SCALE[axis] };
}

const along = (axis, values, style, width) => values &&
  { x: shown.curve[axis], y: values, length: values.length, scaleX: SCALE[axis], colour: style, width };

function cursorOn(axis, points) {
  return cursor === null ? null : { x: shown.curve[axis][cursor] * SCALE[axis], points };
}

function forceScene(colour, axis) {
  const { curve, events } = shown;
  const point = (values, style) => values && { y: values[cursor], colour: style };
  return {
    x: axisOf(axis), y: { label: "force [N]", ...range([0, ...curve.force, ...(curve.model ?? [])], [0.06, 0.12]) },
    curves: [along(axis, curve.force, colour.quiet, 1.2), along(axis, curve.model, colour.a, 2)].filter(Boolean),
    marks: events.map((one, k) => ({
      x: one[axis] * SCALE[axis], y: one.force, colour: one.given ? colour.cutting : colour.b, number: k,
      text: axis === "time" || one.kind === "puncture" || held === k ? one.kind : "", // over depth, contact and exit are one place
    })),
    cursor: cursorOn(axis, [point(curve.force, colour.quiet), point(curve.model, colour.a)].filter(Boolean)),
  };
}

function residualScene(colour, axis) {
  const { curve } = shown;
  const left = curve.residual ?? [];
  return {
    x: axisOf(axis), y: { label: "residual [N]", ...range([0, ...left], [0.1, 0.1]) },
    curves: [along(axis, left, colour.stiffness, 1.2)], marks: [],
    cursor: cursorOn(axis, [{ y: left[cursor], colour: colour.stiffness }]),
  };
}

/** The sample nearest to the pointer: along time by its time, along depth by the curve. */
function nearest(place, axis, x, y, values) {
  const { curve } = shown;
  if (axis === "time") return sampleAt(curve, place.valueAt(x));
  let [best, least] = [0, Infinity];
  for (let i = 0; i < curve.force.length; ++i) {
    const far = (place.x(curve.depth[i] * SCALE.depth) - x) ** 2 + 0.25 * (place.y(values[i]) - y) ** 2;
    if (far < least) [best, least] = [i, far];
  }
  return best;
}

/** Lets the reader look at the plots, zoom them and move events. */
export function listenToPlots() {
  for (const { id, axis, ranges: looked, scene } of PLOTS) listen(at(id), id, axis, looked, scene);
}

function listen(canvas, id, axis, looked, scene) {
  const whole = () => (shown && (id.startsWith("recorded") || shown.curve.model) ? scene(colours(), axis) : null);
  const size = () => ({ width: canvas.clientWidth, height: canvas.clientHeight });
  const place = () => mapping(size(), zoomed(whole(), looked));
  const markAt = ({ offsetX, offsetY }) => {
    if (!whole()) return null;
    const [here, { marks }] = [place(), zoomed(whole(), looked)];
    const far = (mark) => Math.hypot(here.x(mark.x) - offsetX, here.y(mark.y) - offsetY);
    const [best] = [...marks].sort((a, b) => far(a) - far(b));
    return best && far(best) < NEAR ? best.number : null;
  };
  listenToZoom(canvas, looked, whole, (dragged) => { box = dragged && { id, ...dragged }; drawPlots(); }, (event) => markAt(event) !== null);
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    held = markAt(event);
    if (held !== null) canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!whole()) return;
    const values = id.startsWith("recorded") ? shown.curve.force : shown.curve.residual;
    cursor = lastLookedAt = nearest(place(), axis, event.offsetX, event.offsetY, values);
    const { curve, events, onMove } = shown;
    if (held !== null) onMove(held, within(curve, events, held, curve.time[cursor]));
    canvas.classList.toggle("on-mark", held !== null || markAt(event) !== null);
    state();
    drawPlots();
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, () => { held = null; });
  canvas.addEventListener("pointerleave", () => {
    if (held !== null) return;
    cursor = null;
    state();
    drawPlots();
  });
}

function state() {
  const { curve } = shown;
  const values = cursor === null ? [] : [["time", curve.time[cursor], 2, "s"], ["depth", 1e3 * curve.depth[cursor], 2, "mm"],
    ["force", curve.force[cursor], 3, "N"], ["model", curve.model?.[cursor], 3, "N"], ["residual", curve.residual?.[cursor], 4, "N"]];
  at("looked-at").textContent = values.filter(([, value]) => Number.isFinite(value)).map(([name, value, places, unit]) =>
    `${name} ${value.toFixed(places).replace("-", "−")} ${unit}`).join(", ");
}
