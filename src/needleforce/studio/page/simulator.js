// SPDX-License-Identifier: Apache-2.0
// The simulator: its models and its motion, what moves the needle, and what the page states of it.

import { showModel } from "./controls.js";
import { colours, onColours, paint, pngOf, svgOf } from "./drawing.js";
import { csvText, headerText, presetText, save } from "./exports.js";
import { fromPreset, linkText, stateOfLink } from "./model.js";
import { drawPlot, mapping } from "./plot.js";
import { NAMES, depthScene, drawLegend, eventPlace, runsOf, sectionScene, timeScene } from "./scenes.js";
import { drawSection, sectionScale } from "./section.js";
import { MAX_STEPS, STEP, Trace, stroke } from "./trace.js";

const HAND_SPEED = 0.2, KEY_SPEED = 0.01; // [m/s]
const KEYS = { ArrowDown: 0.1, ArrowUp: -0.1, PageDown: 1, PageUp: -1 }; // [mm]
const at = (id) => document.getElementById(id);
const still = matchMedia("(prefers-reduced-motion: reduce)"); // a reader who wants nothing to move by itself

let tables, Insertion;
const state = { models: [null, null], motion: { speed: 3e-3, depth: 12e-3 } };
let trace, lowest = 0, chosen = 0;
let playing = null; // the depths that are still to come
let hand = null; // { target, speed, held } of a hand that moves the needle
let byHand = false; // whether the motion is a hand's, which no link has
let cursor = null; // the step that the reader looks at
let waiting = false, before = 0; // for the next frame; time of the last one [ms]

// --- models and motion ---------------------------------------------------------------------------------------------

const insertionOf = (model) => model && new Insertion(model.layers, { max_speed: 1 });
const startDepth = () => -Math.max(2e-3, 0.2 * state.motion.depth);
/** What the drawings show. */
const shown = () => ({ trace, models: state.models, presets: tables.presets, chosen, cursor, lowest, deepest: deepest() });

/** The model in the page, if the core takes it; else the reason, and what was stays. */
function takeModel(k, model, whole) {
  trouble("");
  try {
    const insertion = insertionOf(model);
    const fresh = model && whole && model.preset !== state.models[k]?.preset;
    state.models[k] = model;
    trace.replace(k, insertion);
    at("refusal").textContent = "";
    if (fresh && !byHand && k === 0) {
      state.motion.depth = tables.presets[model.preset].stroke;
      begin(true);
    }
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    at("refusal").textContent = `The core refuses this: ${error.message}. The force shown is that of the model before.`;
  }
  if (whole) showControls();
  redraw();
}

/** The stroke from the start, played or at once. */
function begin(atOnce) {
  const { depth, speed } = state.motion;
  trace = new Trace(state.models.map(insertionOf), startDepth());
  [lowest, byHand, hand, cursor] = [startDepth() - 2.4e-3, false, null, null];
  playing = stroke(startDepth(), depth, speed);
  at("depth").value = String(Number((1e3 * depth).toPrecision(4)));
  if (atOnce) finish();
  before = 0;
  redraw();
}

function finish() {
  for (const depth of playing ?? []) trace.advance(depth);
  playing = null;
  redraw();
}

function startAgain() {
  trace = new Trace(state.models.map(insertionOf), startDepth());
  [byHand, playing, hand, cursor] = [true, null, null, null];
  redraw();
}

/** A hand takes the needle: a motion that was played to its end makes room for its own. */
function takeInHand(change, speed, held) {
  if (!playing && !byHand) startAgain();
  const from = hand?.target ?? trace.here;
  [playing, byHand, cursor] = [null, true, null];
  hand = { target: Math.min(deepest(), Math.max(lowest, from + change)), speed, held };
  redraw();
}

const deepest = () => Math.max(1.15 * state.motion.depth, ...state.models.flatMap((model) =>
  model ? [tables.presets[model.preset].stroke] : []));

// --- frames --------------------------------------------------------------------------------------------------------

/** Draws at the next frame. */
export function redraw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(frame);
}

function frame(now) {
  waiting = false;
  const steps = before ? Math.min(50, Math.round(now - before)) : 0;
  before = now;
  if (playing) play(steps);
  else if (hand) follow(steps);
  draw();
  if ((playing || hand) && !trace.isFull) redraw();
  else before = 0;
}

function play(steps) {
  for (let i = 0; i < steps; ++i) {
    const { value, done } = playing.next();
    if (done) return void (playing = null);
    trace.advance(value);
  }
}

function follow(steps) {
  trace.follow(hand.target, steps, hand.speed);
  if (!hand.held && trace.here === hand.target) hand = null;
}

// --- drawings ------------------------------------------------------------------------------------------------------

const lookedAt = () => cursor ?? trace.length - 1;

function draw() {
  paint(at("section"), (context, size, colour) => drawSection(context, size, colour, sectionScene(shown())));
  paint(at("over-depth"), (context, size, colour) => drawPlot(context, size, colour, depthScene(shown(), colour)));
  paint(at("over-time"), (context, size, colour) => drawPlot(context, size, colour, timeScene(shown(), colour)));
  showValues();
  showWords();
  at("skip").disabled = !playing;
}

// --- words ---------------------------------------------------------------------------------------------------------

const number = (value, places) => value.toFixed(places).replace(/^-(?=[0.]*$)/, "").replace("-", "−");

function showValues() {
  const now = lookedAt();
  at("where").textContent = `depth ${number(1e3 * trace.depth[now], 2)} mm, time ${number(trace.time[now], 2)} s`;
  for (const { cells, dataset } of at("values").rows)
    trace.runs.forEach((run, k) => {
      cells[k + 1].hidden = !run;
      if (run && dataset.row) cells[k + 1].textContent = valueOf(run, dataset.row, now);
    });
  const section = at("section");
  section.setAttribute("aria-valuemin", (1e3 * lowest).toFixed(1));
  section.setAttribute("aria-valuemax", (1e3 * deepest()).toFixed(1));
  section.setAttribute("aria-valuenow", (1e3 * trace.depth[now]).toFixed(2));
  section.setAttribute("aria-valuetext", `${number(1e3 * trace.depth[now], 2)} mm`);
}

function valueOf(run, row, now) {
  if (row === "phase") return run.phases.findLast(({ from }) => from <= now).phase;
  return `${number(run.columns[row][now], 3)} N`;
}

function showWords() {
  const several = state.models[1];
  const sentences = runsOf(trace).map((one) => {
    const listed = one.run.events.map((event) => {
      const { depth, force } = eventPlace(trace, one, event);
      const kind = { punctured: "puncture", contact: "contact", exit: "exit" }[event.kind];
      return `${kind} at ${number(depth, 2)} mm${kind === "puncture" ? `, ${number(force, 3)} N` : ""}`;
    });
    const refused = one.run.refused ? [`${one.run.refused} steps outside the range of a law`] : [];
    const all = [...listed.slice(-6), ...refused].join(" · ") || "no contact yet";
    return several ? `${NAMES[one.k]}: ${all}` : all;
  });
  if (trace.isFull) sentences.push(`${(MAX_STEPS * STEP) / 60} minutes are over: start again.`);
  const text = sentences.join("  —  ");
  if (at("events").textContent !== text) at("events").textContent = text;
}

/** States what went wrong, above everything; nothing to take it away. */
export function trouble(text) {
  at("trouble").hidden = !text;
  at("trouble").textContent = text;
}

// --- controls ------------------------------------------------------------------------------------------------------

function showControls() {
  NAMES.forEach((_, k) => {
    at(`tab-${k}`).hidden = !state.models[k];
    at(`tab-${k}`).setAttribute("aria-selected", String(k === chosen));
  });
  at("second").textContent = state.models[1] ? "Remove B" : "Add model B";
  at("model").setAttribute("aria-labelledby", `tab-${chosen}`);
  showModel(at("model"), tables, () => state.models[chosen], (model, whole) => takeModel(chosen, model, whole));
}

function choose(k) {
  chosen = k;
  at("refusal").textContent = "";
  showControls();
  redraw();
}

function listenToNeedle() {
  const section = at("section");
  let from = null;
  section.addEventListener("pointerdown", (event) => {
    section.setPointerCapture(event.pointerId);
    from = event.clientY;
    takeInHand(0, HAND_SPEED, true);
  });
  section.addEventListener("pointermove", (event) => {
    if (from === null) return;
    const { pixels } = sectionScale({ height: section.clientHeight }, { low: lowest, high: deepest() });
    takeInHand((event.clientY - from) / pixels, HAND_SPEED, true);
    from = event.clientY;
  });
  const letGo = () => {
    from = null;
    if (hand) hand.held = false;
  };
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) section.addEventListener(name, letGo);
  section.addEventListener("wheel", (event) => {
    event.preventDefault();
    takeInHand(2e-4 * Math.sign(event.deltaY), KEY_SPEED, false);
  }, { passive: false });
  section.addEventListener("keydown", (event) => {
    if (!(event.key in KEYS)) return;
    event.preventDefault();
    takeInHand(1e-3 * KEYS[event.key], KEY_SPEED, false);
  });
}

function listenToPlots() {
  const look = (canvas, scene, nearest) => {
    canvas.addEventListener("pointermove", (event) => {
      const place = mapping({ width: canvas.clientWidth, height: canvas.clientHeight }, scene(shown(), colours()));
      cursor = hand || playing ? null : nearest(place, event.offsetX, event.offsetY);
      redraw();
    });
    canvas.addEventListener("pointerleave", () => { cursor = null; redraw(); });
  };
  const within = (i) => Math.max(0, Math.min(trace.length - 1, Math.round(i)));
  look(at("over-time"), timeScene, (place, x) => within(place.valueAt(x) / STEP));
  look(at("over-depth"), depthScene, (place, x, y) => {
    const { force } = trace.runs[chosen].columns;
    let [best, least] = [0, Infinity];
    for (let i = 0; i < trace.length; ++i) {
      const far = (place.x(1e3 * trace.depth[i]) - x) ** 2 + 0.25 * (place.y(force[i]) - y) ** 2;
      if (far < least) [best, least] = [i, far];
    }
    return best;
  });
}

function listenToBar() {
  const depthGiven = () => Number(at("depth").value.replace(",", ".")) / 1e3;
  const insert = (speed) => {
    const depth = depthGiven();
    if (!(depth >= 1e-4 && depth <= 0.1)) return trouble(`The depth “${at("depth").value}” is not a number from 0.1 to 100 mm.`);
    trouble("");
    state.motion = { speed, depth };
    begin(still.matches);
  };
  at("slow").addEventListener("click", () => insert(1e-3));
  at("fast").addEventListener("click", () => insert(3e-3));
  at("skip").addEventListener("click", finish);
  at("again").addEventListener("click", startAgain);
  NAMES.forEach((_, k) => at(`tab-${k}`).addEventListener("click", () => choose(k)));
  at("second").addEventListener("click", () => {
    const has = state.models[1];
    if (has) chosen = 0;
    takeModel(1, has ? null : structuredClone(state.models[0]), false);
    choose(has ? 0 : 1);
  });
  at("export").addEventListener("click", ({ target }) => target.dataset.export && give(target.dataset.export));
  document.addEventListener("pointerdown", ({ target }) => at("export").contains(target) || (at("export").open = false));
  document.addEventListener("keydown", ({ key }) => key === "Escape" && (at("export").open = false));
  addEventListener("hashchange", () => location.hash && takeLink());
  addEventListener("resize", redraw);
  onColours(redraw);
}

// --- what the page gives away --------------------------------------------------------------------------------------

const pictureParts = () => [
  { draw: (context, size, colour) => drawSection(context, size, colour, sectionScene(shown())), width: 240, height: 620, x: 10, y: 10 },
  { draw: (context, size, colour) => drawPlot(context, size, colour, depthScene(shown(), colour)), width: 690, height: 330, x: 260, y: 10 },
  { draw: (context, size, colour) => drawPlot(context, size, colour, timeScene(shown(), colour)), width: 690, height: 280, x: 260, y: 350 },
  { draw: (context, size, colour) => drawLegend(context, size, colour, shown()), width: 690, height: 24, x: 322, y: 634 },
];

async function give(what) {
  const model = state.models[chosen];
  const name = model.preset;
  at("export").open = false;
  if (what === "link") giveLink();
  if (what === "preset") save(`${name}.toml`, presetText(tables, model));
  if (what === "header") save(`${name}.hpp`, headerText(tables, model));
  if (what === "csv") save(`${name}.csv`, csvText(tables, model, trace, trace.runs[chosen]), "text/csv");
  if (what === "svg") save(`${name}.svg`, svgOf(pictureParts(), 960, 664), "image/svg+xml");
  if (what === "png") save(`${name}.png`, await pngOf(pictureParts(), 960, 664));
}

function giveLink() {
  history.replaceState(null, "", `#${linkText(tables, state)}`);
  const note = byHand ? " It has the models; a motion by hand is not in it." : "";
  const say = (copied) => trouble(`The address of this page is now the link${copied ? ", and it is copied" : ""}.${note}`);
  navigator.clipboard ? navigator.clipboard.writeText(location.href).then(() => say(true), () => say(false)) : say(false);
}

function takeLink() {
  let text = "";
  try {
    const { models, motion } = stateOfLink(tables, location.hash.slice(1));
    models.forEach(insertionOf);
    Object.assign(state, { models, motion });
  } catch (error) {
    text = `The link cannot be opened: ${error.message}. The page shows ${trace ? "what it did" : "its first model"}.`;
  }
  trouble(text);
  chosen = 0;
  if (trace && text) return;
  begin(true);
  showControls();
}

/** Takes a model that was identified, as the page has its presets, as A (0) or B (1). */
export function takeIdentified(k, preset) {
  let name = preset.name;
  for (let n = 2; name in tables.presets && JSON.stringify(tables.presets[name].layers) !== JSON.stringify(preset.layers); ++n)
    name = `${preset.name}_${n}`;
  tables.presets[name] = preset;
  takeModel(k, fromPreset(tables, name), true);
  choose(k);
}

/** Shows the first model, or that of a link, with the tables and the class of the core. */
export function startSimulator(given, core) {
  [tables, Insertion] = [given, core];
  state.models = [fromPreset(tables, "paper"), null];
  state.motion.depth = tables.presets.paper.stroke;
  listenToNeedle();
  listenToPlots();
  listenToBar();
  if (location.hash) return takeLink();
  begin(true);
  showControls();
}
