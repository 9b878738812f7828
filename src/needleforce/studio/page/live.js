// SPDX-License-Identifier: Apache-2.0
// A rig that is watched while the recorder records it: started and stopped from the page, with what was confirmed. All
// that comes from the server is set as text.

import { openRecording } from "./analyse.js";
import { element, words } from "./controls.js";
import { onColours } from "./drawing.js";
import { drawRun } from "./live_plot.js";
import { BUSY, listen, order, Trace } from "./live_stream.js";

const ANSWER_TIME = 1000, REST_TIME = 4000, BEGIN_TIME = 15000, SILENT_TIME = 1500; // [ms]
const EMERGENCY = "Press the emergency stop of the rig, or switch the axis off.";
const RESTARTED = "The server was started again: a run that was in progress was stopped, and what it recorded is in its file.";
const SHOWN_EVENTS = 200;
const NUMBERS = { start: 1e-3, depth: 1e-3, speed: 1e-3, hold: 1 };
const at = (id) => document.getElementById(id);

const trace = new Trace();
let state = { state: "idle", run: 0 }, server = null, heard = 0;
let events = [], leftOut = 0, rates = [], waits = [], stopped = null, drawn = true;

/** Shows the view's controls, and listens. `openView(name)` shows another view. */
export async function startLive(openView) {
  at("live-setup").addEventListener("submit", (event) => {
    event.preventDefault();
    begin();
  });
  for (const id of ["live-rig", "live-motion"]) at(id).addEventListener("change", showSetup);
  at("stop").addEventListener("click", stop);
  addEventListener("keydown", onKey, { capture: true });
  at("live-analyse").addEventListener("click", () => handOver(openView));
  addEventListener("resize", drawLive);
  onColours(drawLive);
  setInterval(watchServer, 250);
  await choose();
  listen(take, lost);
}

/** Draws the plots, after the view was shown or something came. */
export function drawLive() {
  drawn = true;
  if (at("live").hidden || at("live-run").hidden) return;
  const canvases = { time: at("live-time"), depth: at("live-over-depth") };
  drawRun(canvases, trace, phases(), state.found?.events ?? []);
}

async function choose() {
  const choices = await (await fetch("live")).json();
  const options = (names) => names.map((name) => element("option", { value: name }, words(name)));
  const named = choices.rig === null ? [] : [element("option", { value: "connected" }, choices.rig)];
  at("live-rig").replaceChildren(...named, element("option", { value: "virtual" }, "virtual rig"));
  at("live-tissue").replaceChildren(...options(choices.virtual));
  at("live-model").replaceChildren(element("option", { value: "" }, "no model"), ...options(choices.models));
  at("live-model").value = choices.models.includes("paper") ? "paper" : "";
  at("live-rig").dataset.axis = choices.has_axis ? "yes" : "";
  showSetup();
}

function showSetup() {
  const virtual = at("live-rig").value === "virtual", busy = BUSY.includes(state.state);
  const moves = virtual || at("live-rig").dataset.axis === "yes";
  if (!moves) at("live-motion").value = "none";
  for (const each of at("live-setup").elements) each.disabled = busy;
  at("live-motion").disabled = busy || !moves;
  at("live-tissue-label").hidden = !virtual;
  for (const name of Object.keys(NUMBERS)) at(`live-${name}`).parentElement.hidden = at("live-motion").value === "none";
}

const number = (name) => Number.parseFloat(at(`live-${name}`).value.replace(",", ".").replace("−", "-"));

async function begin() {
  const motion = Object.fromEntries(Object.entries(NUMBERS).map(([name, unit]) => [name, unit * number(name)]));
  const asked = {
    rig: at("live-rig").value, tissue: at("live-tissue").value, model: at("live-model").value || null,
    surface: 1e-3 * number("surface"), motion: at("live-motion").value === "none" ? null : motion,
  };
  at("live-refused").textContent = "";
  try {
    at("live-refused").textContent = (await order("start", asked)).error ?? "";
  } catch (error) {
    at("live-refused").textContent = `The server does not answer: ${error.message}`;
  }
}

function onKey(event) {
  const here = event.key === "Escape" || (event.key === " " && !at("live").hidden);
  if (!here || !BUSY.includes(state.state)) return;
  event.preventDefault();
  event.stopPropagation();
  stop();
}

/** Orders the stop; what is not confirmed in time is stated, with what to do. Each press orders it again. */
function stop() {
  if (!BUSY.includes(state.state)) return;
  endWaits();
  stopped = performance.now();
  outcome("Stop ordered …");
  const answer = setTimeout(() => alarm(`The server has not answered the stop within 1 s. ${EMERGENCY}`), ANSWER_TIME);
  const time = state.state === "starting" ? BEGIN_TIME : REST_TIME;
  const rest = setTimeout(() => alarm(`The axis is not confirmed to be at rest ${time / 1000} s after the stop. ${EMERGENCY}`), time);
  waits = [answer, rest];
  order("stop").then(() => clearTimeout(answer), () => alarm(`The server does not answer the stop. ${EMERGENCY}`));
}

function endWaits() {
  waits.forEach(clearTimeout);
  waits = [];
}

function take(message) {
  heard = performance.now();
  const again = server !== null && server !== message.server;
  server = message.server;
  if (message.fresh) [events, leftOut, rates] = [[], 0, []], trace.clear();
  if (again || message.run !== state.run) newRun();
  trace.add(message.points, message.readings);
  events.push(...message.events);
  leftOut += message.events_left_out + Math.max(0, events.length - SHOWN_EVENTS);
  if (events.length > SHOWN_EVENTS) events = events.slice(-SHOWN_EVENTS);
  const before = state.state;
  state = message;
  if (again) outcome(RESTARTED, true);
  if (again || before !== state.state) changed();
  show();
}

function newRun() {
  endWaits();
  stopped = null;
  alarm("");
  outcome("");
}

/** The state is another one: what ended is reported, and what was not confirmed. */
function changed() {
  showSetup();
  at("stop-bar").hidden = !BUSY.includes(state.state);
  if (state.state !== "ended") return;
  endWaits();
  const { refused, end, confirmed } = state;
  if (refused) outcome(`No recording was made: ${refused}`, true);
  if (end) outcome(ended(end), !end.complete || Boolean(end.unwritten));
  alarm(confirmed ? "" : `The axis was not seen to stop: ${refused ?? end.stop ?? "it is not seen any more"}. ${EMERGENCY}`);
}

function ended({ ended: why, why: ordered, detail, seconds, received, lost: missing, stop: rest }) {
  const first = { interrupted: `Stopped (${ordered || "Ctrl+C"})`, done: "Done" }[why] ?? `Ended early: ${why}`;
  const after = rest && detail && detail !== rest ? `${detail}; ${rest}` : rest ?? detail;
  return `${first}${after ? `: ${after.replace(/-(?=\d)/g, "−")}` : ""}. ${seconds.toFixed(1)} s, ${received} readings, ${missing} lost.`;
}

function lost() {
  fetch("live").then(
    async (answer) => connection(answer.ok ? "" : `The server refuses this page: ${(await answer.text()).trim()}`),
    () => connection("The server does not answer: it was stopped, or the network is gone. This page looks for it every second."),
  );
}

function watchServer() {
  if (!BUSY.includes(state.state) || performance.now() - heard < SILENT_TIME) return;
  const since = "No word from the server for 1.5 s, while the rig may move.";
  alarm(`${since} The recorder stops the axis by itself when it hears of no page for 2 s; if the needle moves: ${EMERGENCY}`);
}

function alarm(text) {
  at("alarm").hidden = !text;
  if (at("alarm").textContent !== text) at("alarm").textContent = text;
}

function outcome(text, wrong = false) {
  at("live-outcome").textContent = text;
  at("live-outcome").classList.toggle("wrong", wrong);
}

function connection(text) {
  at("live-connection").textContent = text || "connected to the server";
  at("live-connection").classList.toggle("wrong", Boolean(text));
}

function show() {
  connection("");
  if (!stopped && !at("alarm").hidden && BUSY.includes(state.state)) alarm(""); // it was silence, and it is over
  at("live-run").hidden = state.run === 0;
  showFacts();
  const left = trace.readings - trace.length;
  at("live-drawn").textContent = `${trace.readings} readings, ${trace.length} drawn` +
    (left ? `; of the others each stretch has its lowest and highest force` : "");
  at("live-file").textContent = state.file ? `Recorded to ${state.file}` : "";
  at("live-analyse").hidden = !(state.state === "ended" && state.end);
  const list = at("live-events").lastElementChild;
  if (list.childElementCount !== events.length || leftOut) list.replaceChildren(...events.map(item));
  if (drawn) requestAnimationFrame(drawLive);
  drawn = false;
}

const item = ({ time, kind, text }) => element("li", {}, `${time.toFixed(3)} s  ${kind}: ${text}`);

function showFacts() {
  const { seconds = 0, received = 0, lost: missing = 0, force, depth, phase } = state.progress ?? {};
  rates.push([seconds, received]);
  while (rates.length > 2 && seconds - rates[1][0] >= 1) rates.shift();
  const rate = seconds > rates[0][0] ? (received - rates[0][1]) / (seconds - rates[0][0]) : NaN;
  const shown = (value, places, unit) => (Number.isFinite(value) ? `${value.toFixed(places).replace("-", "−")} ${unit}` : "–");
  const { limits, force_limit: limit } = state.opened ?? {};
  const facts = [
    ["status", state.state], ["phase", phase ?? "–"], ["force", shown(force, 3, "N")], ["depth", shown(1e3 * depth, 2, "mm")],
    ["recorded", shown(seconds, 1, "s")], ["rate", shown(rate, 0, "Hz")], ["lost", String(missing)],
    ["force limit", shown(limit, 1, "N")], ["axis", limits ? `${limits.slice(0, 2).map((each) => (1e3 * each).toFixed(0).replace("-", "−")).join(" to ")} mm` : "–"],
  ];
  at("live-facts").replaceChildren(...facts.map(([name, text]) => element("div",
    { className: name === "lost" && missing ? "wrong" : "" }, element("dt", {}, name), element("dd", {}, text))));
}

/** Phases of the motion as bands, from the recorder's marks. */
function phases() {
  const begun = events.filter(({ kind }) => kind === "phase");
  return begun.map(({ time, text }, i) => ({ from: time, to: begun[i + 1]?.time ?? trace.time.at(-1) ?? time, text }));
}

async function handOver(openView) {
  try {
    const { key, name, error } = await order("analyse");
    if (error) return outcome(error, true);
    openView("analyse");
    openRecording(key, name);
  } catch (error) {
    outcome(`The server does not answer: ${error.message}`, true);
  }
}
