// SPDX-License-Identifier: Apache-2.0
// What the page states of a steered needle: its numbers, its score, and what went wrong, in words.

import { MAX_STEPS, STEP } from "./steering_motion.js";

export const number = (value, places) =>
  (Number.isFinite(value) ? value.toFixed(places).replace(/^-(?=[0.]*$)/, "").replace("-", "−") : "–");
const three = (values, factor, places, unit) => `${values.map((one) => number(factor * one, places)).join(", ")} ${unit}`;

/** Rows of names and values of the last accepted step. */
export function valueRows({ sample, here }) {
  const { tip, tangent, wrench, force, lateral, axial } = sample;
  return [
    ["tip x, y, depth", three(tip, 1e3, 2, "mm")],
    ["tip off the axis", `${number(1e3 * Math.hypot(tip[0], tip[1]), 2)} mm`],
    ["slope at the tip", `${number((180 / Math.PI) * Math.acos(Math.min(1, tangent[2])), 1)}°`],
    ["axial force", `${number(force, 3)} N`],
    ["friction, cutting", `${number(axial.friction, 3)}, ${number(axial.cutting, 3)} N`],
    ["force on the base", three(wrench.slice(0, 3), 1, 3, "N")],
    ["moment on the base", three(wrench.slice(3), 1e3, 2, "N mm")],
    ["lateral force on the tip", `${number(lateral, 3)} N`],
    ["roll", `${number((180 / Math.PI) * here.roll, 0)}°`],
  ];
}

const gap = ({ least, which }) => {
  if (which < 0) return "no obstacle";
  return least < 0 ? `touches obstacle ${which + 1}` : `${number(1e3 * least, 2)} mm`;
};

/** Cells of a score: where the tip is, how near it came, what its path passed. */
export const scoreCells = (score) => [`${number(1e3 * score.now, 2)} mm`,
  ...(Number.isFinite(score.nearest) ? [`${number(1e3 * score.nearest, 2)} mm`, gap(score)] : ["–", "–"])];
/** The same of a plan as it was planned. */
export const plannedCells = (plan) => (plan
  ? [`${number(1e3 * plan.miss, 2)} mm`, `${number(1e3 * plan.miss, 2)} mm`, plannedGap(plan.clearance)] : ["–", "–", "–"]);
const plannedGap = (clearance) => {
  if (clearance === null) return "no obstacle";
  return clearance < 0 ? "touches an obstacle" : `${number(1e3 * clearance, 2)} mm`;
};

const REFUSED = {
  outside_range: "The core refuses this step: needle, guide or tissue do not reach that far, or the needle would be steeper than it may. Move the base back, or start again.",
  not_finite: "The core's force is not a finite number at this step. Move the base back, or start again.",
  invalid_parameter: "The core refuses a value of this needle. Choose another needle.",
};

/** What is wrong with the motion, or nothing. */
export function troubleOf(motion) {
  const { refusal, here } = motion;
  if (refusal?.buckled) return `The needle buckles at a depth of ${number(1e3 * here.depth, 1)} mm: nothing holds it against its own compression. Withdraw it, or start again.`;
  if (refusal) return `${REFUSED[refusal.status]} The base stays at a depth of ${number(1e3 * here.depth, 1)} mm.`;
  if (motion.isFull) return `${(MAX_STEPS * STEP) / 60} minutes are over: start again.`;
  return "";
}

/** What the needle does. */
export function stateOf(motion, score) {
  const { sample } = motion;
  const phase = sample.axial.phase === "free" ? "above the tissue" : sample.axial.phase;
  const touched = score.least < 0 ? `; its path touches obstacle ${score.which + 1}` : "";
  const refused = motion.statuses.length ? `; the core found no equilibrium in ${motion.statuses.length} of its steps` : "";
  return `${number(motion.time, 1)} s: ${phase}, the tip is ${number(1e3 * score.now, 1)} mm from the target${touched}${refused}`;
}

/** What a plan reaches, and its faults. */
export function planWords({ miss, radius, faults }) {
  const found = `Planned: the tip ends ${number(1e3 * miss, 2)} mm from the target, within ${number(1e3 * radius, 1)} mm with 95 %`;
  return faults.length ? `No plan reaches it within its limits: ${faults.join("; ")}. The best one is drawn.` : `${found}.`;
}
