// SPDX-License-Identifier: Apache-2.0
// Curves over one quantity, on a canvas or as SVG. A scene has, in the units shown:
// x, y: { label, low, high }; curves: [{ x, y, length, scaleX, scaleY, colour, width, dash }] in order of time;
// bands: [{ from, to, text }] along x; marks: [{ x, y, text, onLeft, colour }]; cursor: { x, points: [{ y, colour }] } or null.

import { FONT, ticks } from "./drawing.js";

const MARGIN = { left: 62, right: 14, top: 12, bottom: 42 };
const BAND = 18;

/** From values to pixels of a drawing of this size, and back. */
export function mapping({ width, height }, { x, y, bands }) {
  const [left, right, top] = [MARGIN.left, width - MARGIN.right, MARGIN.top + (bands ? BAND : 0)];
  const bottom = height - MARGIN.bottom;
  return {
    left, right, top, bottom,
    x: (value) => left + ((value - x.low) / (x.high - x.low)) * (right - left),
    y: (value) => bottom - ((value - y.low) / (y.high - y.low)) * (bottom - top),
    valueAt: (pixel) => x.low + ((pixel - left) / (right - left)) * (x.high - x.low),
    valueUp: (pixel) => y.low + ((bottom - pixel) / (bottom - top)) * (y.high - y.low),
  };
}

/** Draws a scene. */
export function drawPlot(context, size, colour, scene) {
  const at = mapping(size, scene);
  axes(context, size, colour, scene, at);
  if (scene.bands) drawBands(context, colour, scene.bands, at);
  context.save();
  context.beginPath();
  context.rect(at.left, at.top - 1, at.right - at.left, at.bottom - at.top + 2);
  context.clip();
  for (const curve of scene.curves) drawCurve(context, curve, at);
  context.restore();
  const taken = []; // by texts
  for (const mark of scene.marks) drawMark(context, mark, at, colour, taken);
  if (scene.cursor) drawCursor(context, scene.cursor, at, colour);
}

function axes(context, { width, height }, colour, { x, y }, at) {
  context.lineWidth = 1;
  context.textBaseline = "middle";
  context.textAlign = "right";
  for (const [value, text] of ticks(y.low, y.high, at.bottom - at.top, 44)) {
    line(context, [[at.left, at.y(value)], [at.right, at.y(value)]], value === 0 ? colour.quiet : colour.line);
    context.fillStyle = colour.quiet;
    context.fillText(text, at.left - 8, at.y(value));
  }
  context.textAlign = "center";
  for (const [value, text] of ticks(x.low, x.high, at.right - at.left, 70)) {
    line(context, [[at.x(value), at.bottom], [at.x(value), at.bottom + 4]], colour.quiet);
    context.fillStyle = colour.quiet;
    context.fillText(text, at.x(value), at.bottom + 13);
  }
  context.fillStyle = colour.ink;
  context.fillText(x.label, (at.left + at.right) / 2, height - 9);
  context.save();
  context.translate(10, (at.top + at.bottom) / 2);
  context.rotate(-Math.PI / 2);
  context.fillText(y.label, 0, 0);
  context.restore();
}

function line(context, points, style, width = 1, dash = []) {
  context.strokeStyle = style;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.beginPath();
  points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.stroke();
  context.setLineDash([]);
}

/** Phases as a strip above the curves, each with its word where it fits. */
function drawBands(context, colour, bands, at) {
  context.textAlign = "center";
  context.textBaseline = "middle";
  bands.forEach(({ from, to, text }, i) => {
    const [left, right] = [at.x(from), at.x(to)];
    context.globalAlpha = i % 2 ? 0.45 : 0.9;
    context.fillStyle = colour.line;
    context.fillRect(left, at.top - BAND, right - left, BAND - 3);
    context.globalAlpha = 1;
    context.fillStyle = colour.quiet;
    if (context.measureText(text).width + 8 < right - left) context.fillText(text, (left + right) / 2, at.top - BAND / 2 - 1);
  });
}

/** A curve with at most four points for each column of pixels: first, lowest, highest, last. */
function drawCurve(context, { x, y, length, scaleX = 1, scaleY = 1, colour, width, dash }, at) {
  const [left, bottom] = [at.x(0), at.y(0)];
  const [perX, perY] = [scaleX * (at.x(1) - left), scaleY * (at.y(1) - bottom)];
  const points = [];
  let column = NaN;
  let [first, low, high, last] = [0, 0, 0, -1];
  const put = () => {
    for (const i of [first, ...(low < high ? [low, high] : [high, low]), last]) {
      const point = [left + perX * x[i], bottom + perY * y[i]];
      const before = points.at(-1);
      if (!before || before[0] !== point[0] || before[1] !== point[1]) points.push(point);
    }
  };
  for (let i = 0; i < length; ++i) {
    const here = Math.round(left + perX * x[i]);
    if (here !== column) {
      if (i) put();
      [column, first, low, high] = [here, i, i, i];
    }
    if (y[i] < y[low]) low = i;
    else if (y[i] > y[high]) high = i;
    last = i;
  }
  if (!length) return;
  put();
  line(context, points, colour, width, dash);
}

/** A point and, where there is room on either side, its text. */
function drawMark(context, { x, y, text, onLeft, colour: style }, at, colour, taken) {
  const [left, top] = [at.x(x), at.y(y)];
  if (left < at.left - 1 || left > at.right + 1) return;
  context.beginPath();
  context.arc(left, top, 4, 0, 2 * Math.PI);
  context.fillStyle = style;
  context.fill();
  context.strokeStyle = colour.paper;
  context.lineWidth = 1.5;
  context.stroke();
  if (!text) return;
  context.font = `600 ${FONT}`;
  const wide = context.measureText(text).width;
  const height = Math.max(at.top + 8, top - 9);
  const places = [left + 9, left - 9 - wide].map((from) => ({ from, to: from + wide, height }));
  const free = (onLeft ? places.reverse() : places).find((place) => place.from >= at.left && place.to <= at.right &&
    taken.every((other) => other.to < place.from || other.from > place.to || Math.abs(other.height - height) > 14));
  context.fillStyle = style;
  context.textAlign = "left";
  context.textBaseline = "middle";
  if (free) context.fillText(text, free.from, height);
  if (free) taken.push(free);
  context.font = FONT;
}

function drawCursor(context, { x, points }, at, colour) {
  line(context, [[at.x(x), at.top], [at.x(x), at.bottom]], colour.quiet, 1, [3, 3]);
  for (const { y, colour: style } of points) {
    context.beginPath();
    context.arc(at.x(x), at.y(y), 3.5, 0, 2 * Math.PI);
    context.fillStyle = style;
    context.fill();
  }
}
