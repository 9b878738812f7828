// SPDX-License-Identifier: Apache-2.0
// The needle in the tissue, seen from the side and to scale, but for the shape of the dimple: a surface that is not yet
// punctured follows the tip; of one that is, the depth at rest is drawn if the friction law states it.

import { ticks } from "./drawing.js";

const AXIS = 44;

/** Pixels of a metre, and from depths to pixels. */
export function sectionScale({ height }, { low, high }) {
  const pixels = height / (high - low);
  return { pixels, y: (depth) => (depth - low) * pixels };
}

/** `scene`: low, high [m]; depth, deepest [m]; layers; punctured: number of layers; tip, as tip.js has it. */
export function drawSection(context, size, colour, scene) {
  const at = sectionScale(size, scene);
  const middle = (AXIS + size.width) / 2;
  context.save();
  context.beginPath();
  context.rect(AXIS, 0, size.width - AXIS, size.height);
  context.clip();
  scene.layers.forEach((layer, i) => drawLayer(context, size, colour, scene, at, middle, i));
  if (scene.punctured) drawCut(context, colour, scene, at, middle);
  drawNeedle(context, colour, scene, at, middle);
  context.restore();
  drawAxis(context, size, colour, scene, at);
}

/** How far the top of a layer is pressed in [m]. */
function dimple({ layers, punctured, depth }, i) {
  const { top, friction, puncture } = layers[i];
  if (i >= punctured) return Math.max(0, depth - top);
  if (friction.dimple_ratio > 0 && puncture.depth > 0) return friction.dimple_ratio * puncture.depth;
  return Math.max(0, friction.resting_surface ?? 0);
}

function drawLayer(context, { width, height }, colour, scene, at, middle, i) {
  const { radius } = scene.tip;
  const pressed = dimple(scene, i);
  const broad = Math.max(radius, 0.45 * pressed + radius) * at.pixels;
  const surface = (x) => at.y(scene.layers[i].top + pressed * Math.exp(-Math.abs(x - middle) / broad));
  context.beginPath();
  context.moveTo(AXIS, height);
  for (let x = AXIS; x <= width + 2; x += 2) context.lineTo(x, surface(x));
  context.lineTo(width + 2, height);
  context.closePath();
  context.fillStyle = i % 2 ? colour.deeper : colour.tissue;
  context.fill();
  context.strokeStyle = colour.cut;
  context.lineWidth = 1.2;
  context.stroke();
  if (scene.layers.length < 2) return;
  context.fillStyle = colour.ink;
  context.textAlign = "right";
  context.textBaseline = "top";
  context.fillText(`layer ${i + 1}`, width - 8, surface(width - 60) + 6);
}

function drawCut(context, colour, { layers, punctured, deepest }, at, middle) {
  const end = punctured < layers.length ? Math.min(deepest, layers[punctured].top) : deepest;
  context.beginPath();
  context.moveTo(middle, at.y(layers[0].top));
  context.lineTo(middle, at.y(end));
  context.strokeStyle = colour.cut;
  context.lineWidth = 2;
  context.stroke();
}

/** At least three pixels wide, with its tip to the same scale. */
function drawNeedle(context, colour, { tip, depth, low }, at, middle) {
  const scale = Math.max(1.5, tip.radius * at.pixels) / tip.radius;
  const [left, right] = [middle - tip.radius * scale, middle + tip.radius * scale];
  context.beginPath();
  context.moveTo(left, at.y(low) - 2);
  for (const [across, above] of tip.points) context.lineTo(middle + across * scale, at.y(depth) - above * scale);
  context.lineTo(right, at.y(low) - 2);
  context.closePath();
  context.fillStyle = colour.needle;
  context.fill();
  context.strokeStyle = colour.edge;
  context.lineWidth = 1.2;
  context.stroke();
}

function drawAxis(context, { height }, colour, { low, high, depth }, at) {
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const [value, text] of ticks(1e3 * low, 1e3 * high, height, 44)) {
    const y = at.y(1e-3 * value);
    if (y < 8 || y > height - 8) continue;
    context.fillStyle = colour.quiet;
    context.fillText(text, AXIS - 8, y);
    context.fillRect(AXIS - 5, y, 5, 1);
  }
  context.fillStyle = colour.a;
  context.beginPath();
  context.moveTo(AXIS, at.y(depth));
  context.lineTo(AXIS - 7, at.y(depth) - 4);
  context.lineTo(AXIS - 7, at.y(depth) + 4);
  context.closePath();
  context.fill();
}
