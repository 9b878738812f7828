// SPDX-License-Identifier: Apache-2.0
// Steering: a needle that bends, moved at its base by mouse, keys, fields or at a constant speed; a target, obstacles, and
// the planner's plan next to one's own motion.

import { onColours, paint, pngOf, svgOf } from "./drawing.js";
import { element } from "./controls.js";
import { save } from "./exports.js";
import { drawPlot } from "./plot.js";
import { NeedleInSolid, SolidField, drawPlaces } from "./solid_field.js";
import { COORDINATES, refreshBase, showBase, showSpots } from "./steering_controls.js";
import { listenToViews } from "./steering_hands.js";
import { SteeredMotion, motionText, movesOf, scoreOf, shapeText } from "./steering_motion.js";
import { askPlan } from "./steering_plan.js";
import { QUANTITIES, steeringScene } from "./steering_plots.js";
import { drawView } from "./steering_views.js";
import { planWords, plannedCells, scoreCells, stateOf, troubleOf, valueRows } from "./steering_words.js";

const PLAYED = 5e-3; // [m/s] of a plan, as the planner's own push
const HURRY = 1500; // steps a frame where the reader does not wait
const VIEWS = ["steer-side", "steer-top"];
const SPOKEN = 1000; // [ms] between two sentences while the needle moves, for who hears them
const at = (id) => document.getElementById(id);
const server = () => "server" in document.documentElement.dataset;

let tables, core, name, preset, field; // the needle that is chosen; the solid it is in, or null
let motion, target, obstacles, plan, kept; // kept: { path, sample } of one's own motion while a plan is played
let playsPlan = false, hurry = false, asking = null, waiting = false, before = 0, chosen = 0;
let spoken = 0; // when the last sentence was shown [ms]
let notice = { text: "", wrong: false }; // what the reader last asked for led to; it stays until the needle moves

// --- needle, target, plan ------------------------------------------------------------------------------------------

function insertion() {
  const { layers } = tables.presets[preset.axial];
  const settings = { max_speed: 1, ...preset.settings };
  if (field) return new NeedleInSolid(core, { ...preset, settings }, layers);
  return new core.FlexibleInsertion(layers, preset.bending, settings);
}

const low = () => -Math.min(26e-3, (preset.bending.guide_distance ?? 20e-3) + 5e-3);
const deepest = () => Math.max(1.1 * preset.depth, 1.1 * target[2]); // where a base may go
const high = () => Math.max(deepest(), field?.down.at(-1) ?? 0);
const start = () => -Math.min(2e-3, 0.1 * preset.depth);

function begin() {
  motion = new SteeredMotion(insertion(), start());
  [playsPlan, hurry, before] = [false, false, 0];
  redraw();
}

/** The needle that the reader chose; the solid is fetched when it is wanted first. */
async function choose(next) {
  const mine = (chosen += 1);
  stopAsking();
  try {
    const found = next === tables.solid.name ? await solidFile() : tables.steering[next];
    if (mine !== chosen) return;
    [name, preset, field] = [next, found, found.field ? new SolidField(found) : null];
  } catch (error) {
    if (mine === chosen) at("steer-needle").value = name;
    return refuse(error.message);
  }
  [target, obstacles, plan, kept] = [[...preset.target], preset.obstacles.map((one) => [...one]), null, null];
  note("");
  at("steer-about").textContent = preset.summary;
  at("steer-to").value = String(Number((1e3 * preset.depth).toPrecision(4)));
  refuse("");
  spots();
  begin();
}

async function solidFile() {
  refuse("The solid is made, which takes some seconds …");
  const answer = await fetch(tables.solid.file).catch(() => null);
  const found = answer?.ok ? await answer.json() : { error: "There is no solid here: the page was written without it, or the server was stopped." };
  if (found.error) throw new Error(found.error);
  return found;
}

function note(text, wrong = false) {
  notice = { text, wrong };
  redraw();
}

const refuse = (text) => { at("steer-refusal").textContent = text; };

function spots() {
  showSpots(at("steer-spots"), target, obstacles, place, refuse);
  at("steer-add").disabled = obstacles.length >= tables.max_obstacles;
}

/** Target and obstacles at other places, for which a plan does not hold. */
function place(aim, around, inHand = false) {
  stopAsking();
  [target, obstacles, plan] = [aim, around, null];
  if (!inHand) spots();
  note("");
}

function stopAsking() {
  asking?.abort();
  asking = null;
}

async function makePlan() {
  const mine = (asking = new AbortController());
  plan = null;
  note("Planning …");
  const question = { preset: name, target, obstacles, rolls: at("steer-rolls").checked };
  const state = (text, wrong) => asking === mine && note(text, wrong);
  try {
    const found = await askPlan(question, mine.signal, (count) => state(`Planning: ${count} evaluations …`));
    if (asking === mine) plan = found;
    state(planWords(found), found.faults.length > 0);
  } catch (error) {
    state(error.message, true);
  }
  if (asking === mine) asking = null;
  redraw();
}

function cancelPlan() {
  stopAsking();
  note("The planner was cancelled.");
}

function playPlan() {
  if (!playsPlan && motion.path.length) kept = { path: motion.path, sample: motion.sample };
  begin();
  playsPlan = true;
  motion.follow(movesOf(plan.moves, PLAYED));
  redraw();
}

// --- what moves the needle -----------------------------------------------------------------------------------------

const bounds = (key) => {
  const { low: least, high: most, factor } = COORDINATES[key];
  return key === "depth" ? [-5e-3, deepest()] : [least / factor, most / factor];
};

/** The base goes to values [m], [rad], as far as the page lets it; a hand ends a plan that is played. */
function go(values, speed) {
  const within = Object.entries(values).map(([key, to]) => {
    const [least, most] = bounds(key);
    return [key, Math.min(most, Math.max(least, to))];
  });
  if (motion.queue.length) motion.stop();
  playsPlan = false;
  motion.go(Object.fromEntries(within), speed);
  if (!asking) note("");
  else redraw();
}

const goBy = (key, change, speed) => go({ [key]: (motion.targets[key]?.to ?? motion.here[key]) + change }, speed);

function insert(speed) {
  const depth = Number(at("steer-to").value.replace(",", ".")) / 1e3;
  const most = deepest();
  if (!(depth >= 1e-4 && depth <= most)) return refuse(`The depth “${at("steer-to").value}” is not a number from 0.1 to ${Math.floor(1e3 * most)} mm.`);
  refuse("");
  if (motion.here.depth >= depth) begin();
  go({ depth }, speed);
}

// --- frames --------------------------------------------------------------------------------------------------------

function redraw() {
  if (waiting || !motion) return;
  waiting = true;
  requestAnimationFrame(frame);
}

function frame(now) {
  waiting = false;
  const steps = before ? Math.min(50, Math.round(now - before)) : 0;
  before = now;
  motion.run(hurry ? HURRY : steps);
  if (!at("steering").hidden) draw();
  if (motion.moves) redraw();
  else [before, hurry] = [0, false];
}

function scene() {
  const score = scoreOf(motion, target, obstacles);
  const shape = motion.insertion.shape();
  return {
    low: low(), high: high(), from: start(), layers: preset.bending.lateral.map(({ top }) => top), guide: preset.bending.guide_distance ?? null,
    roll: motion.here.roll, radius: preset.radius, shape, target, obstacles, score,
    path: motion.sample.tip[2] >= 0 ? [...motion.path, motion.sample.tip] : motion.path,
    pushed: Boolean(preset.settings.bevel_face_share) || preset.bending.lateral.some((one) => one.tip_force),
    kept: kept?.path ?? null, planned: plan?.path ?? null, touched: score.least < 0 ? score.which : -1,
    motion, plan, solid: null,
  };
}

/** What draws the solid in the view along an axis. */
function solidOf({ shape, path }, axis) {
  const rows = field.places(motion.insertion.forces(), field.forcesAcross(shape, path, axis));
  return (context, colour, place) => {
    const most = drawPlaces(context, colour, place, rows);
    at("steer-moved").textContent = `· tissue moved by up to ${(1e3 * most).toFixed(2)} mm`;
  };
}

const inView = (shown, axis) => (field ? { ...shown, solid: solidOf(shown, axis) } : shown);

function draw() {
  const shown = scene();
  VIEWS.forEach((id, axis) => {
    paint(at(id), (context, size, colour) => drawView(context, size, colour, inView(shown, axis), axis));
  });
  if (!field) at("steer-moved").textContent = "";
  for (const [id, quantity] of Object.entries(QUANTITIES))
    paint(at(id), (context, size, colour) => drawPlot(context, size, colour, steeringScene(shown, quantity, colour)));
  refreshBase(motion.here);
  showWords(shown.score);
}

function showWords(score) {
  const wrong = troubleOf(motion);
  const text = wrong || notice.text || stateOf(motion, score);
  if (at("steer-words").textContent !== text && (wrong || notice.text || !motion.moves || performance.now() > spoken + SPOKEN)) {
    at("steer-words").textContent = text;
    spoken = performance.now();
  }
  at("steer-words").classList.toggle("wrong", Boolean(wrong) || notice.wrong);
  at("steer-own").cells[0].textContent = playsPlan ? "the plan, played" : "this motion";
  const cells = { own: scoreCells(score), kept: kept ? scoreCells(scoreOf(kept, target, obstacles)) : [], planned: plannedCells(plan) };
  for (const [row, texts] of Object.entries(cells))
    texts.forEach((each, k) => { at(`steer-${row}`).cells[k + 1].textContent = each; });
  at("steer-kept").hidden = !kept;
  at("steer-values").tBodies[0].replaceChildren(...valueRows(motion).map(([what, value]) =>
    element("tr", {}, element("th", { scope: "row" }, what), element("td", {}, value))));
  showButtons();
}

function showButtons() {
  at("steer-skip").disabled = !motion.moves || hurry;
  at("steer-plan").disabled = !server() || Boolean(asking);
  at("steer-play").disabled = !plan;
  at("steer-cancel").hidden = !asking;
  at("steer-export").querySelector("[data-export=plan]").disabled = !plan;
}

// --- what the reader does ------------------------------------------------------------------------------------------

function exportAs(what) {
  at("steer-export").open = false;
  if (what === "steps") save(`steered_${name}.csv`, motionText(motion, name, tables.version), "text/csv");
  if (what === "shape") save(`shape_${name}.csv`, shapeText(motion), "text/csv");
  if (what === "plan") save(`plan_${name}.csv`, plannedRows(plan), "text/csv");
  if (what === "svg") save(`steered_${name}.svg`, svgOf(pictureParts(), 1000, 620), "image/svg+xml");
  if (what === "png") pngOf(pictureParts(), 1000, 620).then((picture) => save(`steered_${name}.png`, picture));
}

/** The drawings as one picture: the two views, and the plots to their right. */
function pictureParts() {
  const shown = scene();
  const views = VIEWS.map((_, axis) => ({ width: 260, height: 600, x: 10 + 270 * axis, y: 10,
    draw: (context, size, colour) => drawView(context, size, colour, inView(shown, axis), axis) }));
  const plots = Object.values(QUANTITIES).map((quantity, k) => ({ width: 440, height: 196, x: 550, y: 10 + 200 * k,
    draw: (context, size, colour) => drawPlot(context, size, colour, steeringScene(shown, quantity, colour)) }));
  return [...views, ...plots];
}

/** The table that `needleforce steer simulate --motion` reads. */
const plannedRows = ({ moves }) => ["depth_mm,base_x_mm,base_y_mm,roll_deg", ...moves.map(([depth, x, y, roll]) =>
  [1e3 * depth, 1e3 * x, 1e3 * y, (180 / Math.PI) * roll].join(",")), ""].join("\n");

function listen() {
  const acts = { "steer-slow": () => insert(2e-3), "steer-fast": () => insert(5e-3), "steer-plan": makePlan, "steer-play": playPlan,
    "steer-skip": () => { hurry = true; redraw(); }, "steer-again": () => { kept = null; note(""); begin(); }, "steer-cancel": cancelPlan,
    "steer-add": () => place(target, [...obstacles, [0, 0, 0.5 * target[2], 2e-3]]) };
  for (const [id, act] of Object.entries(acts)) at(id).addEventListener("click", act);
  at("steer-needle").addEventListener("change", ({ target: { value } }) => choose(value));
  at("steer-export").addEventListener("click", ({ target: one }) => one.dataset.export && exportAs(one.dataset.export));
  document.addEventListener("pointerdown", ({ target: one }) => at("steer-export").contains(one) || (at("steer-export").open = false));
  listenToViews(VIEWS.map(at), { place, go, goBy, spots, now: () => ({ low: low(), high: high(), here: motion.here, target, obstacles }) });
  addEventListener("resize", redraw);
  onColours(redraw);
}

/** Makes the view's controls; nothing is computed before it is opened. */
export function startSteering(given, compiled) {
  [tables, core] = [given, compiled];
  const choices = [...Object.entries(tables.steering).map(([key, { title }]) => [key, title]), [tables.solid.name, tables.solid.title]];
  at("steer-needle").replaceChildren(...choices.map(([value, title]) => element("option", { value }, title)));
  showBase(at("steer-base"), (key, value) => go({ [key]: value }), goBy, refuse);
  if (!server()) at("steer-plan").title = "Planning needs the studio's own server: run needleforce studio.";
  listen();
}

/** Draws the view that was opened; the first time with its first needle. */
export function openSteering() {
  if (!motion) choose(Object.keys(tables.steering)[0]);
  if (server()) return redraw();
  note("Planning needs the studio's own server: run needleforce studio. All else works here.");
}
