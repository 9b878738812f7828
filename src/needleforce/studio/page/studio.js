// SPDX-License-Identifier: Apache-2.0
// The page: loads the core and the tables, and shows one view at a time.

import { drawAll, startAnalyse } from "./analyse.js";
import { load } from "./core/needleforce.mjs";
import { redraw, startSimulator, takeIdentified, trouble } from "./simulator.js";

// what draws each view when it is opened
const VIEWS = { simulator: redraw, analyse: drawAll };
const at = (id) => document.getElementById(id);

function open(wanted) {
  for (const view of Object.keys(VIEWS)) {
    at(view).hidden = view !== wanted;
    at(`to-${view}`).setAttribute("aria-pressed", String(view === wanted));
  }
  VIEWS[wanted]();
}

/** The studio's own server has more than the simulator, and marks the page so. */
function startViews() {
  if (!("server" in document.documentElement.dataset)) return;
  startAnalyse((k, preset) => {
    takeIdentified(k, preset);
    open("simulator");
    scrollTo(0, 0);
  });
  at("views").hidden = false;
  for (const view of Object.keys(VIEWS)) at(`to-${view}`).addEventListener("click", () => open(view));
}

async function start() {
  if (typeof WebAssembly !== "object") throw new Error("this browser has no WebAssembly, in which the core is compiled");
  const [answer, core] = await Promise.all([fetch("tables.json"), load()]);
  at("version").textContent = `version ${core.version}`;
  const tables = await answer.json();
  at("loading").hidden = true;
  at("simulator").hidden = false;
  startViews();
  startSimulator(tables, core.Insertion);
}

start().catch((error) => {
  at("loading").hidden = true;
  trouble(`The studio cannot start: ${error.message}.`);
});
