// SPDX-License-Identifier: Apache-2.0
// The events of a recording as they are and as the reader moves them: { contact, punctures, exit } are the given times,
// each absent where the found one stands.

import { element } from "./controls.js";

const shownNumber = (value, places) => (value === undefined ? "" : value.toFixed(places).replace("-", "−"));

/** The sample of a curve that is nearest to a time. */
export function sampleAt({ time }, wanted) {
  let [low, high] = [0, time.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (time[middle] < wanted) low = middle;
    else high = middle;
  }
  return wanted - time[low] <= time[high] - wanted ? low : high;
}

/** The events that are shown, [{ kind, time, depth, force, given }] in their order: those found, with those given. */
export function eventsOf({ events, curve }, given = {}) {
  const at = (kind, time) => {
    const i = sampleAt(curve, time);
    return { kind, time, depth: curve.depth[i], force: curve.force[i], given: true };
  };
  const one = (kind) => (given[kind] === undefined ? events.filter((each) => each.kind === kind) : [at(kind, given[kind])]);
  const punctures = given.punctures === undefined ? events.filter((each) => each.kind === "puncture")
    : given.punctures.map((time) => at("puncture", time));
  return [...one("contact"), ...punctures, ...one("exit")];
}

/** What is given when event number `k` of those shown is at another time, or, without one, is no more. */
export function moved(shown, k, time, given) {
  const { kind } = shown[k];
  if (kind !== "puncture") return { ...given, [kind]: time };
  const others = shown.map((one, i) => (i === k ? time : one.time)).filter((each, i) => shown[i].kind === "puncture" && each !== null);
  return { ...given, punctures: others };
}

/** What is given with a puncture more, at a time. */
export function added(shown, time, given) {
  const times = shown.filter(({ kind }) => kind === "puncture").map((one) => one.time);
  return { ...given, punctures: [...new Set([...times, time])].sort((a, b) => a - b) };
}

/** A time for event `k` between those before and after it, on a sample of the curve. */
export function within(curve, shown, k, time) {
  const before = k > 0 ? sampleAt(curve, shown[k - 1].time) + 1 : 0;
  const after = k + 1 < shown.length ? sampleAt(curve, shown[k + 1].time) - 1 : curve.time.length - 1;
  return curve.time[Math.min(Math.max(sampleAt(curve, time), before), Math.max(before, after))];
}

/**
 * Fills the table of the events: each has its time in a field, which the arrow keys move by a sample.
 *
 * @param {HTMLTableElement} table - its body is filled
 * @param {object} curve - of the recording
 * @param {object[]} shown - the events
 * @param {function(number, number|null)} onMove - takes the number of an event and its new time, null to remove it
 */
export function showEvents(table, curve, shown, onMove) {
  const focused = table.contains(document.activeElement) ? document.activeElement.id : "";
  table.tBodies[0].replaceChildren(...shown.map((one, k) => {
    const field = element("input", { type: "text", inputMode: "decimal", id: `event-${k}`, value: String(Number(one.time.toFixed(4))),
      autocomplete: "off", "aria-label": `time of the ${one.kind} in s` });
    field.addEventListener("change", () => {
      const time = Number(field.value.replace(",", "."));
      if (field.value.trim() && Number.isFinite(time)) onMove(k, within(curve, shown, k, time));
      else field.value = String(one.time);
    });
    field.addEventListener("keydown", (event) => {
      const step = { ArrowUp: 1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
      if (!step) return;
      event.preventDefault();
      const i = sampleAt(curve, one.time) + step;
      onMove(k, within(curve, shown, k, curve.time[Math.min(Math.max(i, 0), curve.time.length - 1)]));
    });
    const remove = element("button", { type: "button", title: "No puncture here", "aria-label": "remove this puncture" }, "×");
    remove.addEventListener("click", () => onMove(k, null));
    return element("tr", { className: one.given ? "given" : "" }, element("th", { scope: "row" }, one.kind, one.given ? ", given" : ""),
      element("td", {}, field, " s"), element("td", {}, `${shownNumber(1e3 * one.depth, 2)} mm`),
      element("td", {}, `${shownNumber(one.force, 3)} N`), element("td", {}, ...(one.kind === "puncture" ? [remove] : [])));
  }));
  if (focused) document.getElementById(focused)?.focus();
}
