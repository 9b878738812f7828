// SPDX-License-Identifier: Apache-2.0
// The page: loads the core and the tables, and shows one view at a time.

import { drawAll, startAnalyse } from "./analyse.js";
import { load } from "./core/needleforce.mjs";
import { drawLive, startLive } from "./live.js";
import { redraw, startSimulator, takeIdentified, trouble } from "./simulator.js";
import { openSteering, startSteering } from "./steering.js";

// what draws each view when it is opened
const VIEWS = { simulator: redraw, steering: openSteering, analyse: drawAll, live: drawLive };
const OF_THE_SERVER = ["analyse", "live"];
const at = (id) => document.getElementById(id);

function open(wanted) {
  for (const view of Object.keys(VIEWS)) {
    at(view).hidden = view !== wanted;
    at(`to-${view}`).setAttribute("aria-pressed", String(view === wanted));
  }
  VIEWS[wanted]();
}

function startWithServer() {
  startAnalyse((k, preset) => {
    takeIdentified(k, preset);
    open("simulator");
    scrollTo(0, 0);
  });
  startLive(open);
}

/** The studio's own server has more than simulator and steering, and marks the page so. */
function startViews() {
  const server = "server" in document.documentElement.dataset;
  for (const view of OF_THE_SERVER) at(`to-${view}`).hidden = !server;
  if (server) startWithServer();
  at("views").hidden = false;
  for (const view of Object.keys(VIEWS)) at(`to-${view}`).addEventListener("click", () => open(view));
}

async function given(name) {
  const answer = await fetch(name).catch(() => ({ ok: false, status: "no answer" }));
  if (!answer.ok) throw new Error(`${name} is not there (${answer.status})`);
  return answer;
}

async function start() {
  if (typeof WebAssembly !== "object") throw new Error("this browser has no WebAssembly, in which the core is compiled");
  const [answer, compiled] = await Promise.all(["tables.json", "core/needleforce.wasm"].map(given));
  const [tables, core] = [await answer.json(), await load(await compiled.arrayBuffer())];
  at("version").textContent = `version ${core.version}`;
  at("loading").hidden = true;
  at("simulator").hidden = false;
  startSteering(tables, core);
  startViews();
  startSimulator(tables, core.Insertion);
}

start().catch((error) => {
  at("loading").hidden = true;
  trouble(`The studio cannot start: ${error.message}.`);
});
