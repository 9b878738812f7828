// SPDX-License-Identifier: Apache-2.0
// The steered needle in its tissue, to scale, from the side (x over depth) and from the top (y over depth): layers or
// solid, guide, needle, the path that its tip left, the plan's path, target and obstacles.

import { ticks } from "./drawing.js";

const AXIS = 42, FOOT = 22; // [px] of the scales
const ARROW = 16; // [px] of the bevel's direction

/** Pixels of a metre, and from places in tissue to pixels and back; `axis`: 0 from the side, 1 from the top. */
export function viewScale({ width, height }, { low, high }, axis) {
  const pixels = (height - FOOT) / (high - low);
  const middle = (AXIS + width) / 2;
  return {
    pixels, axis, left: AXIS, right: width, bottom: height - FOOT,
    x: (across) => middle + across * pixels,
    y: (depth) => (depth - low) * pixels,
    at: (point) => [middle + point[axis] * pixels, (point[2] - low) * pixels],
    acrossAt: (pixel) => (pixel - middle) / pixels,
    depthAt: (pixel) => low + pixel / pixels,
  };
}

/**
 * `scene`: low, high [m]; layers: tops [m]; guide [m] or null; base; shape; radius [m]; path, kept, planned: points or
 * null; target; obstacles; touched: number of the obstacle that the path touches; roll [rad]; pushed: whether the tip is pushed
 * aside; solid: what draws it, or null.
 */
export function drawView(context, size, colour, scene, axis) {
  const at = viewScale(size, scene, axis);
  context.save();
  context.beginPath();
  context.rect(AXIS, 0, size.width - AXIS, at.bottom);
  context.clip();
  if (scene.solid) scene.solid(context, colour, at);
  else drawLayers(context, size, colour, scene, at);
  scene.obstacles.forEach((one, k) => drawObstacle(context, colour, one, k, k === scene.touched, at));
  if (scene.kept) line(context, scene.kept, at, colour.quiet, 1.5);
  if (scene.planned) line(context, scene.planned, at, colour.b, 2, [6, 4]);
  line(context, scene.path, at, colour.cut, 2);
  drawNeedle(context, colour, scene, at);
  drawHolder(context, colour, scene, at);
  drawBevel(context, colour, scene, at);
  drawTarget(context, colour, scene.target, at);
  context.restore();
  drawScales(context, size, colour, scene, at);
}

function drawLayers(context, { width }, colour, { layers }, at) {
  layers.forEach((top, i) => {
    context.fillStyle = i % 2 ? colour.deeper : colour.tissue;
    context.fillRect(AXIS, at.y(top), width - AXIS, Math.max(0, at.bottom - at.y(top)));
    context.fillStyle = colour.cut;
    context.fillRect(AXIS, at.y(top), width - AXIS, 1);
  });
}

function line(context, points, at, style, width, dash = []) {
  if (points.length < 2) return;
  context.beginPath();
  points.forEach((point, i) => (i ? context.lineTo(...at.at(point)) : context.moveTo(...at.at(point))));
  context.strokeStyle = style;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
}

function drawNeedle(context, colour, { shape, radius }, at) {
  if (shape.length < 2) return;
  const wide = Math.max(3, 2 * radius * at.pixels);
  const [first, second] = shape;
  const above = first.map((value, i) => value - 10 * (second[i] - value)); // of a guided needle, above its guide
  const whole = [above, ...shape];
  line(context, whole, at, colour.edge, wide);
  line(context, whole, at, colour.needle, wide - 1.6);
}

/** A guide that is held above the surface, or the hub at the needle's end. */
function drawHolder(context, colour, { guide, shape, radius }, at) {
  if (!shape.length) return;
  const half = Math.max(3, radius * at.pixels) + 1;
  const [x, y] = at.at(shape[0]);
  context.fillStyle = colour.edge;
  if (guide === null) return context.fillRect(x - half - 4, y - 12, 2 * half + 8, 12);
  for (const side of [-1, 1]) context.fillRect(side < 0 ? x - half - 12 : x + half, at.y(-guide) - 10, 12, 10);
}

/** Where the bevel pushes the tip, as far as it is seen from here. */
function drawBevel(context, colour, { shape, roll, pushed }, at) {
  if (!shape.length || !pushed) return;
  const [x, y] = at.at(shape.at(-1));
  const length = ARROW * (at.axis ? Math.sin(roll) : Math.cos(roll));
  context.fillStyle = colour.a;
  context.beginPath();
  context.arc(x, y, 3, 0, 2 * Math.PI);
  context.fill();
  if (Math.abs(length) < 3) return;
  context.fillRect(Math.min(x, x + length), y - 1, Math.abs(length), 2);
  const way = Math.sign(length);
  context.beginPath();
  context.moveTo(x + length + 5 * way, y);
  context.lineTo(x + length, y - 4);
  context.lineTo(x + length, y + 4);
  context.closePath();
  context.fill();
}

function drawTarget(context, colour, target, at) {
  const [x, y] = at.at(target);
  context.strokeStyle = colour.stiffness;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(x, y, 7, 0, 2 * Math.PI);
  context.stroke();
  context.fillStyle = colour.stiffness;
  context.fillRect(x - 11, y - 1, 22, 2);
  context.fillRect(x - 1, y - 11, 2, 22);
}

function drawObstacle(context, colour, [x, y, z, radius], k, touched, at) {
  const [left, top] = at.at([x, y, z]);
  const wide = Math.max(4, radius * at.pixels);
  context.beginPath();
  context.arc(left, top, wide, 0, 2 * Math.PI);
  context.globalAlpha = touched ? 0.75 : 0.4;
  context.fillStyle = touched ? colour.a : colour.friction;
  context.fill();
  context.globalAlpha = 1;
  context.strokeStyle = touched ? colour.a : colour.friction;
  context.lineWidth = touched ? 2.5 : 1.5;
  context.stroke();
  context.fillStyle = colour.ink;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(String(k + 1), left, top);
}

function drawScales(context, { width }, colour, { low, high }, at) {
  context.fillStyle = colour.quiet;
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const [value, text] of ticks(1e3 * low, 1e3 * high, at.bottom, 44)) {
    const y = at.y(1e-3 * value);
    if (y < 8 || y > at.bottom - 4) continue;
    context.fillText(text, AXIS - 8, y);
    context.fillRect(AXIS - 5, y, 5, 1);
  }
  context.textAlign = "center";
  const [left, right] = [at.acrossAt(AXIS), at.acrossAt(width)].map((each) => 1e3 * each);
  for (const [value, text] of ticks(left, right, width - AXIS, 52)) {
    const x = at.x(1e-3 * value);
    if (x < AXIS + 10 || x > width - 10) continue;
    context.fillRect(x, at.bottom, 1, 4);
    context.fillText(text, x, at.bottom + 13);
  }
  context.fillRect(AXIS, at.bottom, width - AXIS, 1);
}
