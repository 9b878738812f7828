// SPDX-License-Identifier: Apache-2.0
// Mouse, touch, wheel and keys on the two views of a steered needle: they move its base, the target or an obstacle.

import { viewScale } from "./steering_views.js";

const HAND = 0.05; // [m/s] of a base that is dragged
const NEAR = 16; // [px] within which a hand takes the target
const ACROSS = ["x", "y"]; // coordinate of the base that a view shows
const TURN = (5 * Math.PI) / 180;
const KEYS = { ArrowDown: 0.5, ArrowUp: -0.5, PageDown: 5, PageUp: -5 }; // [mm] of depth
const ASIDE = { ArrowRight: 0.25, ArrowLeft: -0.25 }; // [mm]
const ROLLS = { q: -TURN, "[": -TURN, e: TURN, "]": TURN };

const sizeOf = (canvas) => ({ width: canvas.clientWidth, height: canvas.clientHeight });

/** What is under a place of a view: { kind: "target" }, { kind: "obstacle", k } or { kind: "base" }. */
function under(at, x, y, { target, obstacles }) {
  const away = (point) => Math.hypot(at.at(point)[0] - x, at.at(point)[1] - y);
  if (away(target) < NEAR) return { kind: "target" };
  const k = obstacles.findIndex((one) => away(one) < Math.max(8, one[3] * at.pixels));
  return k < 0 ? { kind: "base" } : { kind: "obstacle", k };
}

function drag(held, at, x, y, acts) {
  const { target, obstacles } = acts.now();
  const [across, depth] = [(x - held.x) / at.pixels, (y - held.y) / at.pixels];
  const coordinate = ACROSS[at.axis];
  if (held.kind === "base") return acts.go({ depth: held.here.depth + depth, [coordinate]: held.here[coordinate] + across }, HAND);
  const moved = held.spot.with(at.axis, held.spot[at.axis] + across).with(2, Math.max(1e-3, held.spot[2] + depth));
  if (held.kind === "target") acts.place(moved, obstacles, true);
  else acts.place(target, obstacles.with(held.k, moved), true);
}

/** `acts`: place, go, goBy, spots, and now() with { low, high, here, target, obstacles }. */
export function listenToViews(canvases, acts) {
  canvases.forEach((canvas, axis) => {
    const scaleNow = () => viewScale(sizeOf(canvas), acts.now(), axis);
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      const { offsetX: x, offsetY: y } = event;
      const { here, target, obstacles } = acts.now();
      const at = scaleNow(), found = under(at, x, y, { target, obstacles });
      held = { ...found, x, y, at, here, spot: found.kind === "target" ? target : obstacles[found.k] };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", ({ offsetX, offsetY }) => held && drag(held, held.at, offsetX, offsetY, acts));
    for (const end of ["pointerup", "pointercancel"])
      canvas.addEventListener(end, () => { if (held && held.kind !== "base") acts.spots(); held = null; });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      acts.goBy("depth", (event.deltaMode ? 33 : 1) * event.deltaY * 2e-5);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => press(event, axis, acts));
  });
}

function press(event, axis, { goBy }) {
  const { key, ctrlKey, altKey, metaKey } = event;
  if (ctrlKey || altKey || metaKey) return;
  if (key in KEYS) goBy("depth", 1e-3 * KEYS[key]);
  else if (key in ASIDE) goBy(ACROSS[axis], 1e-3 * ASIDE[key]);
  else if (key.toLowerCase() in ROLLS) goBy("roll", ROLLS[key.toLowerCase()]);
  else return;
  event.preventDefault();
}
