// SPDX-License-Identifier: Apache-2.0
// A recording and what was fitted to it, in a notebook, by the contract of anywidget: force over depth and over time with
// the studio's plots. Both show the same samples: the stretch of time that is looked at is `time_range` of the model.

import { colours, onColours, paint } from "./drawing.js";
import { drawPlot, mapping } from "./plot.js";
import { Range, drawBox, listenToZoom, zoomed } from "./zoom.js";

const AXES = [{ name: "depth", label: "depth [mm]", scale: 1e3, unit: "mm" }, { name: "time", label: "time [s]", scale: 1, unit: "s" }];
const KINDS = ["a", "b", "stiffness", "friction", "cutting"]; // names of the colours of fits

const fitColour = (colour, k) => colour[KINDS[(k - 1) % KINDS.length]];

/** { time, depth, force } and the fits as [name, force along the samples]. */
function read(model) {
  const { rows, fits, marks } = model.get("shown");
  const { buffer, byteOffset, byteLength } = model.get("columns"); // in which the numbers may begin anywhere
  const numbers = new Float64Array(buffer.slice(byteOffset, byteOffset + byteLength));
  const [time, depth, force, ...others] = Array.from({ length: 3 + fits.length }, (_, i) => numbers.subarray(i * rows, (i + 1) * rows));
  return { rows, time, depth, force, fits: fits.map((name, k) => [name, others[k]]), marks };
}

/** The least and the largest number, with a share of their distance on either side. */
function span(columns, from, to, room) {
  let [low, high] = [Infinity, -Infinity];
  for (const column of columns)
    for (let i = from; i < to; ++i) {
      if (column[i] < low) low = column[i];
      if (column[i] > high) high = column[i];
    }
  if (!(low <= high)) return { low: 0, high: 1 };
  const more = high > low ? room * (high - low) : 0.5;
  return { low: low - more, high: high + more };
}

/** First and last sample of a stretch of time, the last not included. */
function stretch({ time, rows }, [start, end] = []) {
  if (start === undefined) return [0, rows];
  const first = time.findIndex((t) => t >= start);
  const last = time.findLastIndex((t) => t <= end);
  return first < 0 || last <= first ? [0, rows] : [first, last + 1];
}

function sceneOf(data, axis, colour, cursor, [from, to]) {
  const forces = [data.force, ...data.fits.map(([, force]) => force)];
  const [first, last] = axis.name === "time" ? [0, data.rows] : [from, to]; // over time the rest is there, out of sight
  const x = data[axis.name].subarray(first, last);
  const curve = (y, style, width) => ({ x, y: y.subarray(first, last), length: last - first, scaleX: axis.scale, colour: style, width });
  const { low, high } = span([data[axis.name]], first, last, 0);
  return {
    x: { label: axis.label, low: low * axis.scale, high: high * axis.scale },
    y: { label: "force [N]", ...span(forces, from, to, 0.08) },
    curves: forces.map((y, k) => curve(y, k ? fitColour(colour, k) : colour.quiet, k ? 2 : 1.2)),
    marks: data.marks.filter(({ at }) => at >= from && at < to).map(({ at, kind }) => (
      { x: data[axis.name][at] * axis.scale, y: data.force[at], colour: colour.b, text: axis.name === "time" || kind === "puncture" ? kind : "" })),
    cursor: cursor === null || cursor < from || cursor >= to ? null : {
      x: data[axis.name][cursor] * axis.scale,
      points: forces.map((y, k) => ({ y: y[cursor], colour: k ? fitColour(colour, k) : colour.quiet })),
    },
  };
}

function made(name, parent, style, properties = {}) {
  const one = Object.assign(document.createElement(name), properties);
  one.style.cssText = style;
  parent.append(one);
  return one;
}

const number = (value, places) => value.toFixed(places).replace("-", "−");

/** What the cursor is on, in words with their colours; without one what the colours mean. */
function words({ time, depth, force, fits }, cursor, colour) {
  const at = (each) => (cursor === null ? "" : Number.isFinite(each[cursor]) ? ` ${number(each[cursor], 3)} N` : " –");
  const named = [["measured", force], ...fits].map(([name, each], k) => [name + at(each), k ? fitColour(colour, k) : colour.quiet]);
  if (cursor === null) return named;
  return [...named, [`${number(1e3 * depth[cursor], 2)} mm, ${number(time[cursor], 2)} s`, colour.ink]];
}

function render({ model, el }) {
  let data, cursor = null;
  const ranges = AXES.map(() => ({ x: new Range(), y: null }));
  const frame = made("div", el, "display:flex;flex-wrap:wrap;gap:10px;padding:8px");
  const canvases = AXES.map(({ name }) => made("canvas", frame, "flex:1 1 320px;min-width:0;height:280px;cursor:crosshair;touch-action:pan-y",
    { tabIndex: 0, role: "img", ariaLabel: `force over ${name}` }));
  const legend = made("p", frame, "flex:1 0 100%;margin:0;min-height:1.5em;font:13px system-ui,sans-serif;font-variant-numeric:tabular-nums");
  const shownRows = () => stretch(data, model.get("time_range"));
  const scene = (k) => sceneOf(data, AXES[k], colours(), cursor, shownRows());

  function drawWords() {
    legend.replaceChildren();
    for (const [text, colour] of words(data, cursor, colours()))
      made("span", legend, `margin-right:14px;color:${colour}`, { textContent: `${text} ` });
  }
  function draw(dragged = null, box = null) {
    Object.assign(frame.style, { background: colours().paper });
    canvases.forEach((canvas, k) => paint(canvas, (context, size, colour) => {
      drawPlot(context, size, colour, zoomed(scene(k), ranges[k]));
      if (k === dragged) drawBox(context, colour, box);
    }));
    drawWords();
  }
  function nearest(k, x, y) {
    const place = mapping({ width: canvases[k].clientWidth, height: canvases[k].clientHeight }, zoomed(scene(k), ranges[k]));
    const [from, to] = shownRows();
    let [best, least] = [from, Infinity];
    for (let i = from; i < to; ++i) {
      const far = (place.x(data[AXES[k].name][i] * AXES[k].scale) - x) ** 2 + 0.25 * (place.y(data.force[i]) - y) ** 2;
      if (far < least) [best, least] = [i, far];
    }
    return best;
  }
  /** What is zoomed over time is the stretch that both show, and that Python has. */
  function settle(k, box) {
    if (AXES[k].name === "time" && !box) {
      model.set("time_range", ranges[k].x.part ?? []);
      model.save_changes();
    }
    draw(k, box);
  }

  canvases.forEach((canvas, k) => {
    // the wheel scrolls the notebook until the plot was clicked
    const scrolls = (event) => event.ctrlKey || document.activeElement === canvas || event.stopImmediatePropagation();
    canvas.addEventListener("wheel", scrolls, { capture: true });
    listenToZoom(canvas, ranges[k], () => scene(k), (box) => settle(k, box));
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) return;
      cursor = nearest(k, event.offsetX, event.offsetY);
      draw();
    });
    canvas.addEventListener("pointerleave", () => { cursor = null; draw(); });
  });
  const again = () => {
    data = read(model);
    const part = model.get("time_range");
    ranges[1].x.part = part.length ? part : null;
    draw();
  };
  const size = new ResizeObserver(() => draw());
  size.observe(frame);
  const names = ["change:columns", "change:time_range"];
  for (const name of names) model.on(name, again);
  const ended = onColours(() => draw());
  again();
  return () => {
    size.disconnect();
    ended();
    for (const name of names) model.off(name, again);
  };
}

export default { render };
