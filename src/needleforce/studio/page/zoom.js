// SPDX-License-Identifier: Apache-2.0
// The part of a scene that is looked at, for any plot of plot.js: drag a box, turn the wheel or use the keys; a double
// click shows all again. Plots that share a range along x are given one `Range` each.

import { mapping } from "./plot.js";

const WHEEL = 1.25, LEAST = 1e-4; // per notch; of the whole range
const DRAGGED = 5; // [pixels] a shorter drag is a click
const KEYS = { "+": 1 / WHEEL, "=": 1 / WHEEL, "-": WHEEL };

/** A range along one axis: `part` is [low, high] in the units shown, or null for the whole one. */
export class Range {
  part = null;

  /** The axis { label, low, high } as it is looked at. */
  of(axis) { return this.part ? { ...axis, low: this.part[0], high: this.part[1] } : axis; }

  /** Takes a part of the whole axis; all of it where that is nearly what is taken. */
  take(low, high, axis) {
    const whole = axis.high - axis.low;
    const size = Math.max(LEAST * whole, Math.min(high - low, whole));
    const first = Math.min(Math.max(low, axis.low), axis.high - size);
    this.part = size > 0.999 * whole ? null : [first, first + size];
  }
}

/** A scene with the ranges that are looked at: { x: Range, y: Range or null for the whole }. */
export function zoomed(scene, ranges) {
  const [x, y] = [ranges.x.of(scene.x), ranges.y ? ranges.y.of(scene.y) : scene.y];
  const inside = (axis, value) => value >= axis.low && value <= axis.high;
  const marks = scene.marks.filter((mark) => inside(x, mark.x) && inside(y, mark.y));
  const cursor = scene.cursor && inside(x, scene.cursor.x)
    ? { ...scene.cursor, points: scene.cursor.points.filter((point) => inside(y, point.y)) } : null;
  return { ...scene, x, y, marks, cursor };
}

/** Draws the box that is being dragged over a plot, after the plot. */
export function drawBox(context, colour, box) {
  if (!box) return;
  const [left, top] = [Math.min(box.from[0], box.to[0]), Math.min(box.from[1], box.to[1])];
  const [wide, high] = [Math.abs(box.to[0] - box.from[0]), Math.abs(box.to[1] - box.from[1])];
  context.globalAlpha = 0.15;
  context.fillStyle = colour.b;
  context.fillRect(left, top, wide, high);
  context.globalAlpha = 1;
}

/**
 * Lets the reader zoom a canvas.
 *
 * @param {HTMLCanvasElement} canvas - of the plot
 * @param {{x: Range, y: Range|null}} ranges - that the plot is drawn with, by `zoomed`
 * @param {function(): object|null} scene - the whole scene that is shown, null while there is none
 * @param {function(object|null)} redraw - draws the plot again, with the box that is being dragged
 * @param {function(PointerEvent): boolean} [taken] - whether a press belongs to something else, as a mark that is moved
 */
export function listenToZoom(canvas, ranges, scene, redraw, taken = () => false) {
  let box = null;
  const place = () => mapping({ width: canvas.clientWidth, height: canvas.clientHeight }, zoomed(scene(), ranges));
  const at = (event) => [event.offsetX, event.offsetY];
  const around = (factor, pixel) => {
    const { x } = scene();
    const { low, high } = ranges.x.of(x);
    const middle = pixel === null ? (low + high) / 2 : Math.min(high, Math.max(low, place().valueAt(pixel)));
    ranges.x.take(middle - factor * (middle - low), middle + factor * (high - middle), x);
    redraw(null);
  };
  const all = () => {
    ranges.x.part = null;
    if (ranges.y) ranges.y.part = null;
    redraw(null);
  };

  canvas.addEventListener("pointerdown", (event) => {
    if (!scene() || event.button || event.pointerType === "touch" || taken(event)) return;
    canvas.setPointerCapture(event.pointerId);
    box = { from: at(event), to: at(event) };
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!box) return;
    box.to = at(event);
    redraw(box);
  });
  canvas.addEventListener("pointerup", () => {
    if (!box || !scene()) return;
    const { from, to } = box;
    const [{ x, y }, here] = [scene(), place()];
    box = null;
    if (Math.abs(to[0] - from[0]) > DRAGGED) {
      const [low, high] = [from[0], to[0]].sort((a, b) => a - b).map(here.valueAt);
      ranges.x.take(low, high, x);
      const [below, above] = [from[1], to[1]].sort((a, b) => b - a).map(here.valueUp);
      if (ranges.y && Math.abs(to[1] - from[1]) > DRAGGED) ranges.y.take(below, above, y);
    }
    redraw(null);
  });
  for (const name of ["pointercancel", "lostpointercapture"])
    canvas.addEventListener(name, () => { if (box) { box = null; redraw(null); } });
  canvas.addEventListener("dblclick", () => scene() && all());
  canvas.addEventListener("wheel", (event) => {
    if (!scene()) return;
    event.preventDefault();
    around(event.deltaY > 0 ? WHEEL : 1 / WHEEL, event.offsetX);
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    if (!scene() || event.ctrlKey || event.metaKey) return;
    const { low, high } = ranges.x.of(scene().x);
    const step = 0.1 * (high - low) * ({ ArrowLeft: -1, ArrowRight: 1 }[event.key] ?? 0);
    if (event.key in KEYS) around(KEYS[event.key], null);
    else if (step) { ranges.x.take(low + step, high + step, scene().x); redraw(null); }
    else if (event.key === "0" || event.key === "Escape") all();
    else return;
    event.preventDefault();
  });
}
