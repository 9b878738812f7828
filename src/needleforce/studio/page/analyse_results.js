// SPDX-License-Identifier: Apache-2.0
// What the page states of a fit or a comparison, and the files that it gives away. They came with the result, so that
// they do not need the server any more.

import { element, words } from "./controls.js";
import { save } from "./exports.js";

const KNOWN = { yes: "", no: "not identified", fixed: "held fixed" };
const at = (id) => document.getElementById(id);
const item = (text) => element("li", {}, text);

/** Fills parameters, warnings and notes; `name` is that of the files that are given away. */
export function showResults(result, name, key) {
  at("report").href = `fits/${key}/report`;
  at("parameters").tBodies[0].replaceChildren(...result.parameters.map(({ name: what, shown, known }) =>
    element("tr", {}, element("th", { scope: "row" }, words(what)), element("td", {}, shown), element("td", {}, KNOWN[known]))));
  at("parameters").hidden = !result.parameters.length;
  at("warnings").replaceChildren(...[...result.remarks, ...result.warnings].map(item));
  at("result-name").textContent = name;
  showExports(result.exports, at("give"), name);
  const { why } = result.simulator;
  at("in-simulator").hidden = Boolean(why);
  at("no-simulator").textContent = why && `Not in the simulator: ${why}`;
}

/** Offers what there is of the files of a result. */
export function showExports(texts, menu, name) {
  for (const button of menu.querySelectorAll("[data-give]")) {
    const ending = button.dataset.give;
    button.hidden = !(ending in texts);
    button.onclick = () => {
      menu.open = false;
      save(`${name}.${ending}`, texts[ending]);
    };
  }
}

/** Status and notes of one recording. */
export function showNotes({ status, notes }, assumed) {
  at("notes").replaceChildren(...(status === "ok" ? [] : [item(`Status: ${words(status)}`)]),
    ...assumed.map((text) => item(`Assumed: ${text}`)), ...notes.map(item));
}

/** The table of a comparison, as the terminal has it. */
export function showComparison({ compared, exports: texts }, key) {
  const { heads, rows, notes } = compared;
  const line = (cells) => element("tr", {}, ...cells.map((cell, i) => element(i ? "td" : "th", i ? {} : { scope: "row" }, i ? cell : words(cell))));
  at("models").replaceChildren(
    element("thead", {}, element("tr", {}, ...heads.map((text) => element("th", { scope: "col" }, text)))),
    element("tbody", {}, ...rows.map(line)));
  at("models-notes").replaceChildren(...notes.map(item));
  at("models-report").href = `fits/${key}/report`;
  showExports(texts, at("models-give"), "comparison");
}
