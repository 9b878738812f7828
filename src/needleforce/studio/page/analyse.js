// SPDX-License-Identifier: Apache-2.0
// A recording dropped on the page: the server identifies it, as the command line does, and the page shows events, model
// and parameters. All that comes from a file is set as text.

import { element, words } from "./controls.js";
import { colours, onColours, paint } from "./drawing.js";
import { drawPlot, mapping } from "./plot.js";

const ASKED_EVERY = 250; // [ms]
const KNOWN = { yes: "", no: "not identified", fixed: "held fixed" };
const at = (id) => document.getElementById(id);

let job = null; // { key, name } of the recording that the server has
let result = null, cursor = null;

/** Lets the reader drop a recording or choose one. */
export function startAnalyse() {
  const place = at("drop");
  at("file").addEventListener("change", () => {
    if (at("file").files.length) take([...at("file").files]);
    at("file").value = "";
  });
  for (const name of ["dragover", "dragleave", "drop"])
    at("analyse").addEventListener(name, (event) => {
      event.preventDefault();
      place.classList.toggle("over", name === "dragover");
      if (name === "drop" && event.dataTransfer.files.length) take([...event.dataTransfer.files]);
    });
  at("cancel").addEventListener("click", () => job && ask(job.key, { method: "DELETE" }));
  for (const [id, axis] of [["recorded-depth", "depth"], ["recorded-time", "time"]]) listen(at(id), axis);
  addEventListener("resize", drawAll);
  onColours(drawAll);
}

/** Draws what was found, after the view was shown. */
export function drawAll() {
  if (!result || at("found").hidden) return;
  paint(at("recorded-depth"), (context, size, colour) => drawPlot(context, size, colour, scene(colour, "depth")));
  paint(at("recorded-time"), (context, size, colour) => drawPlot(context, size, colour, scene(colour, "time")));
}

async function ask(key, options) {
  const answer = await fetch(`recordings/${key}`, options);
  return answer.json();
}

async function take(files) {
  if (job) await ask(job.key, { method: "DELETE" }).catch(() => {});
  const [file] = files;
  const mine = { key: null, name: file.name };
  job = mine;
  [result, cursor] = [null, null];
  at("found").hidden = true;
  const more = files.length > 1 ? ` (the first of ${files.length}; this page takes one at a time)` : "";
  report(`Sending ${file.name}${more} …`, true);
  try {
    const answer = await fetch(`recordings?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
    const { key, error } = await answer.json();
    if (error) return report(error, false, true);
    mine.key = key;
    await follow(mine, more);
  } catch {
    const text = "The server does not answer: it was stopped, or the file was too long. Start needleforce studio again.";
    if (job === mine) report(text, false, true);
  }
}

/** Shows a recording that the server already has, such as one of the live view. */
export async function openRecording(key, name) {
  if (job) await ask(job.key, { method: "DELETE" }).catch(() => {});
  job = { key, name };
  [result, cursor] = [null, null];
  at("found").hidden = true;
  await follow(job, "").catch(() => report("The server does not answer: it was stopped. Start needleforce studio again.", false, true));
}

/** Asks how far it is until it has ended, or another recording takes its place. */
async function follow(mine, more) {
  while (job === mine) {
    const { state, stage, result: found, error } = await ask(mine.key);
    if (job !== mine) return;
    if (error) return report(error, false, true);
    if (state === "waiting") report(`${mine.name}${more}: waits for another to end …`, true);
    else if (state === "running") report(`${mine.name}${more}: ${stage || "starting"} …`, true);
    else return ended(mine, state, found, more);
    await new Promise((done) => setTimeout(done, ASKED_EVERY));
  }
}

function ended({ name, key }, state, found, more) {
  if (state === "cancelled") return report(`${name}: cancelled. Drop it again, or another.`);
  if (state === "failed") return report(`${name}: its process ended without a result. The memory may not suffice.`, false, true);
  if (found.error) return report(found.error, false, true);
  result = found;
  const outcome = found.model ? `model ${words(found.model.replace("identified_", ""))}` : words(found.status);
  report(`${name}${more}: ${outcome}${found.quality ? `, residual ${found.quality}` : ""}`);
  show(key);
}

function report(text, busy = false, wrong = false) {
  at("progress").textContent = text;
  at("progress").classList.toggle("wrong", wrong);
  at("analyse").setAttribute("aria-busy", String(busy));
  at("cancel").hidden = !busy;
}

function show(key) {
  at("report").href = `recordings/${key}/report`;
  at("parameters").tBodies[0].replaceChildren(...result.parameters.map(({ name, shown, known }) =>
    element("tr", {}, element("th", { scope: "row" }, words(name)), element("td", {}, shown), element("td", {}, KNOWN[known]))));
  at("parameters").hidden = !result.parameters.length;
  const item = (text) => element("li", {}, text);
  at("warnings").replaceChildren(...result.warnings.map(item));
  at("notes").replaceChildren(...result.assumed.map((text) => item(`Assumed: ${text}`)), ...result.notes.map(item));
  at("found").hidden = false;
  drawAll();
}

const scale = { depth: 1e3, time: 1 };

function range(axis) {
  const values = result.curve[axis].filter((value) => value !== null);
  const [low, high] = [Math.min(...values), Math.max(...values)].map((value) => value * scale[axis]);
  return { label: axis === "depth" ? "depth [mm]" : "time [s]", low, high: high > low ? high : low + 1 };
}

function scene(colour, axis) {
  const { curve, events } = result;
  const forces = [...curve.force, ...(curve.model ?? [])].filter((value) => value !== null);
  const [low, high] = [Math.min(0, ...forces), Math.max(...forces)];
  const drawn = (values, style, width) => values &&
    { x: curve[axis], y: values, length: values.length, scaleX: scale[axis], colour: style, width };
  const point = (i) => ({ y: curve.force[i], colour: colour.quiet });
  return {
    x: range(axis), y: { label: "force [N]", low: low - 0.06 * (high - low), high: high + 0.12 * (high - low || 1) },
    curves: [drawn(curve.force, colour.quiet, 1.2), drawn(curve.model, colour.a, 2)].filter(Boolean),
    marks: events.map((one) => ({
      x: one[axis] * scale[axis], y: one.force, colour: colour.b,
      text: axis === "time" || one.kind === "puncture" ? one.kind : "", // over depth, contact and exit are one place
    })),
    cursor: cursor === null ? null : { x: curve[axis][cursor] * scale[axis], points: [point(cursor)] },
  };
}

function listen(canvas, axis) {
  canvas.addEventListener("pointermove", ({ offsetX, offsetY }) => {
    if (!result) return;
    const place = mapping({ width: canvas.clientWidth, height: canvas.clientHeight }, scene(colours(), axis));
    const { curve } = result;
    const far = (i) => (place.x(curve[axis][i] * scale[axis]) - offsetX) ** 2 + 0.25 * (place.y(curve.force[i]) - offsetY) ** 2;
    cursor = 0;
    for (let i = 1; i < curve.force.length; ++i) if (far(i) < far(cursor)) cursor = i;
    const model = curve.model?.[cursor];
    const values = [["time", curve.time[cursor], 2, "s"], ["depth", 1e3 * curve.depth[cursor], 2, "mm"],
      ["force", curve.force[cursor], 3, "N"], ["model", model, 3, "N"]].filter(([, value]) => Number.isFinite(value));
    at("looked-at").textContent = values.map(([name, value, places, unit]) =>
      `${name} ${value.toFixed(places).replace("-", "−")} ${unit}`).join(", ");
    drawAll();
  });
  canvas.addEventListener("pointerleave", () => {
    cursor = null;
    at("looked-at").textContent = "";
    drawAll();
  });
}
