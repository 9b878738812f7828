// SPDX-License-Identifier: Apache-2.0
// Recordings dropped on the page: the server reads and identifies them together, as the command line does. This module has
// the list of them and what is done with it; columns.js how each is read, events.js and analyse_plots.js one of them.

import { cancel, follow, offered, start } from "./analyse_files.js";
import { drawPlots, listenToPlots, showPlots, timeOfInterest } from "./analyse_plots.js";
import { showComparison, showNotes, showResults } from "./analyse_results.js";
import { showColumns } from "./columns.js";
import { element, words } from "./controls.js";
import { onColours } from "./drawing.js";
import { added, eventsOf, moved, showEvents } from "./events.js";

const KEPT = "needleforce-analyse", MAX_KEPT = 4e6; // [characters] that a tab keeps when it is loaded again
const STATES = { used: "used", unread: "not used", motion: "motion" };
const at = (id) => document.getElementById(id);

let files = []; // { id, name, file, key, options, motion, events, look, error }
let open = null; // the file whose panel is shown
let running = null; // { key, task } of the fit that is followed; key null while files are sent
let result = null, resultKey = null, shown = 0; // of the last identification; the recording of it that is shown
let fitted = {}; // the events that it was given, by file and part
let choices = null;
let nextId = 1;

/** Lets the reader drop recordings; `openModel` takes 0 or 1, for A or B, and a model as the page has its presets. */
export async function startAnalyse(openModel) {
  listenToFiles();
  listenToPlots();
  at("identify").addEventListener("click", () => run("identify"));
  at("compare").addEventListener("click", () => run("compare"));
  at("cancel").addEventListener("click", () => running?.key && cancel(running.key));
  at("remove-all").addEventListener("click", removeAll);
  at("recording").addEventListener("change", () => showRecording(Number(at("recording").value)));
  at("with-events").addEventListener("click", () => run("identify"));
  at("take-back").addEventListener("click", takeBack);
  at("add-puncture").addEventListener("click", () => give(added(nowShown(), timeOfInterest(), given())));
  for (const k of [0, 1])
    at(`open-${k}`).addEventListener("click", () => openModel(k, { ...result.simulator.preset, identified: true }));
  for (const menu of [at("give"), at("models-give")])
    document.addEventListener("pointerdown", ({ target }) => menu.contains(target) || (menu.open = false));
  addEventListener("resize", drawPlots);
  addEventListener("pagehide", () => running?.key && cancel(running.key));
  onColours(drawPlots);
  choices = await offered().catch(() => null);
  if (!choices) return;
  fill(at("of-needle"), choices.needles, "unknown");
  fill(at("of-model"), choices.models, "by the recordings");
  restore();
}

export { drawPlots as drawAll };

const fill = (select, names, none) => select.replaceChildren(element("option", { value: "" }, none),
  ...names.map((value) => element("option", { value }, words(value))));

// --- files ---------------------------------------------------------------------------------------------------------

function listenToFiles() {
  at("file").addEventListener("change", () => {
    if (at("file").files.length) take([...at("file").files]);
    at("file").value = "";
  });
  for (const name of ["dragover", "dragleave", "drop"])
    at("analyse").addEventListener(name, (event) => {
      event.preventDefault();
      at("drop").classList.toggle("over", name === "dragover");
      if (name === "drop" && event.dataTransfer.files.length) take([...event.dataTransfer.files]);
    });
}

const newFile = (name) => (
  { id: String(nextId++), name, file: null, key: null, options: {}, motion: null, events: {}, look: null, error: "" });

function take(dropped) {
  const most = choices?.most ?? 200;
  for (const file of dropped.slice(0, Math.max(0, most - files.length)))
    files.push({ ...newFile(file.name), file });
  if (dropped.length && files.length >= most) report(`The page takes ${most} files; identify more of them with needleforce campaign.`, false, true);
  run("identify");
}

function removeAll() {
  if (running?.key) cancel(running.key);
  [files, open, running, result, fitted] = [[], null, null, null, {}];
  for (const id of ["found", "compared", "columns", "list"]) at(id).hidden = true;
  report("");
  sessionStorage.removeItem(KEPT);
}

function showFiles() {
  at("list").hidden = !files.length;
  at("remove-all").hidden = !files.length;
  at("files").replaceChildren(...files.map((file) => {
    const name = element("button", { type: "button", className: "name", title: "Its columns, units and signs" }, file.name);
    name.addEventListener("click", () => openPanel(open === file ? null : file));
    name.setAttribute("aria-expanded", String(open === file));
    const remove = element("button", { type: "button", "aria-label": `remove ${file.name}` }, "×");
    remove.addEventListener("click", () => {
      files = files.filter((one) => one !== file);
      if (open === file) openPanel(null);
      showFiles();
    });
    const [state, text] = stateOf(file);
    return element("li", { className: state }, name, element("span", { className: "state" }, text),
      element("span", { className: "problem" }, file.error || file.look?.problem || ""), remove);
  }));
}

function stateOf({ key, error, look }) {
  if (error) return ["unread", "not sent"];
  if (look) return [look.state, STATES[look.state]];
  return running ? ["", key ? "reading" : "sending"] : ["", "not read"];
}

function openPanel(file) {
  open = file;
  at("columns").hidden = !file?.look;
  if (file?.look) {
    const others = files.filter((one) => one !== file);
    showColumns(at("columns"), file, choices, others, ({ options, motion, all }) => {
      for (const one of all ? files : [file]) one.options = structuredClone(options);
      file.motion = motion;
      run("identify");
    });
  }
  showFiles();
}

// --- a fit ---------------------------------------------------------------------------------------------------------

async function run(task) {
  if (running?.key) cancel(running.key);
  if (!files.length) return;
  const mine = { key: null, task };
  running = mine;
  openPanel(null);
  for (const file of files) file.look = null;
  const asked = [...files];
  const events = structuredClone(Object.fromEntries(asked.map((file) => [file.id, file.events])));
  report("Sending …", true);
  try {
    const chosen = { task, needle: at("of-needle").value, model: at("of-model").value };
    mine.key = await start(asked, chosen, () => running === mine && showFiles());
    if (running !== mine) return cancel(mine.key);
    const known = asked.filter(({ key }) => key);
    const answer = await follow(mine.key, (now) => running === mine && progress(now, known));
    if (running === mine) ended(answer, known, events);
  } catch (error) {
    if (running === mine) stopped(error.message, true);
  }
}

/** Adds a recording that the server already has, such as one of the live view. */
export function openRecording(key, name) {
  files.push({ ...newFile(name), key });
  run("identify");
}

function progress({ state, stage, read }, known) {
  if (read) looked(read.files, known);
  report(state === "waiting" ? "Waits for another fit to end …" : `${stage || "starting"} …`, true);
}

function looked(looks, known) {
  looks.forEach((look, k) => { known[k].look = look; });
  showFiles();
}

function stopped(text, wrong = false) {
  running = null;
  report(text, false, wrong);
  showFiles();
}

function ended({ state, result: found }, known, events) {
  if (state === "cancelled") return stopped("Cancelled. Press Identify to do it again.");
  if (state === "failed") return stopped("The process ended without a result. The memory may not suffice.", true);
  if (found.files) looked(found.files, known);
  if (found.error) return stopped(found.error, true);
  const { key } = running;
  running = null;
  const wrong = known.filter(({ look }) => look.state === "unread");
  const none = !found.recordings && !found.compared;
  const answered = wrong.find(({ look }) => look.answered);
  openPanel(answered ?? (none ? wrong[0] : null));
  if (none) return report(`${counted(wrong.length, "file")} cannot be read${answered ? ": choose below what it lacks." : "."}`, false, true);
  if (found.compared) showCompared(found, key, wrong);
  else showFound(found, key, known, events, wrong);
}

const counted = (count, what) => `${count} ${what}${count === 1 ? "" : "s"}`;
const leftOut = (wrong) => (wrong.length ? ` ${counted(wrong.length, "file")} not used.` : "");

function showCompared(found, key, wrong) {
  at("compared").hidden = false;
  showComparison(found, key);
  report(`${found.compared.rows.length} models compared.${leftOut(wrong)}`);
}

function showFound(found, key, known, events, wrong) {
  [result, resultKey, fitted] = [found, key, events];
  for (const each of result.recordings) {
    each.id = known[each.file].id;
    if (each.curve?.model) each.curve.residual = each.curve.force.map((force, i) => force - each.curve.model[i]);
  }
  const outcome = found.model ? `model ${words(found.model.replace("identified_", ""))}` : `no model, ${words(found.recordings[0].status)}`;
  report(`${counted(found.recordings.filter(({ curve }) => curve).length, "recording")}: ${outcome}${found.quality ? `, residual ${found.quality}` : ""}.${leftOut(wrong)}`);
  showAll();
  keep();
}

function report(text, busy = false, wrong = false) {
  at("progress").textContent = text;
  at("progress").classList.toggle("wrong", wrong);
  at("analyse").setAttribute("aria-busy", String(busy));
  at("cancel").hidden = !busy;
  at("actions").hidden = !files.length;
}

// --- its result ----------------------------------------------------------------------------------------------------

const fileOf = ({ id }) => files.find((one) => one.id === id);
const recording = () => result.recordings[shown];
const given = () => fileOf(recording())?.events[recording().part] ?? {};
const nowShown = () => eventsOf(recording(), given());

function showAll() {
  const drawn = result.recordings.map((each, k) => ({ each, k })).filter(({ each }) => each.curve);
  const label = (each) => `${fileOf(each)?.name ?? "removed"}${each.part ? `: ${each.part}` : ""}`;
  at("recording").replaceChildren(...drawn.map(({ each, k }) => element("option", { value: String(k) }, label(each))));
  at("which").hidden = drawn.length < 2;
  at("found").hidden = false;
  const first = label(drawn[0].each).replace(/\.[^.]*$/, "");
  showResults(result, drawn.length > 1 ? `${first} and others` : first, resultKey);
  showRecording(drawn.some(({ k }) => k === shown) ? shown : drawn[0].k);
}

function showRecording(k) {
  shown = k;
  at("recording").value = String(k);
  showNotes(recording(), fileOf(recording())?.look?.assumed ?? []);
  showTheEvents();
}

function showTheEvents() {
  const { curve } = recording();
  const events = nowShown();
  const onMove = (k, time) => give(moved(events, k, time, given()));
  showPlots(curve, events, onMove);
  showEvents(at("event-list"), curve, events, onMove);
  const pending = JSON.stringify(given()) !== JSON.stringify(fitted[recording().id]?.[recording().part] ?? {});
  at("with-events").disabled = !pending;
  at("take-back").disabled = !Object.keys(given()).length;
}

function give(events) {
  fileOf(recording()).events[recording().part] = events;
  showTheEvents();
}

/** Without the given events; where they were fitted, those that are found need a fit. */
function takeBack() {
  const { id, part } = recording();
  delete fileOf(recording()).events[part];
  if (Object.keys(fitted[id]?.[part] ?? {}).length) run("identify");
  else showTheEvents();
}

// --- a page that is loaded again -----------------------------------------------------------------------------------

function keep() {
  const short = files.map(({ file, ...rest }) => rest);
  const text = JSON.stringify({ files: short, result, resultKey, fitted, nextId });
  try {
    if (text.length < MAX_KEPT) sessionStorage.setItem(KEPT, text);
    else sessionStorage.removeItem(KEPT);
  } catch {
    sessionStorage.removeItem(KEPT);
  }
}

function restore() {
  try {
    const text = sessionStorage.getItem(KEPT);
    if (!text) return;
    ({ files, result, resultKey, fitted, nextId } = JSON.parse(text));
  } catch {
    return sessionStorage.removeItem(KEPT);
  }
  showFiles();
  showAll();
  report("The result before this page was loaded again.");
}
