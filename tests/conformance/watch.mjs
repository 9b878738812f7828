// SPDX-License-Identifier: Apache-2.0
// The same streams through WebAssembly, called as trace.mjs.
const ODD = { nan: NaN, inf: Infinity, "-inf": -Infinity };
const number = (word) => ODD[word] ?? Number(word);
const NOTHING = { time: 0, depth: 0, size: 0, probability: 0, delay: 0, kind: "none" };

function step(watch, sample) {
  const { time, depth, size, probability, delay, kind } = watch.step(...sample.map(number)) ?? NOTHING;
  return [time, depth, size, probability, delay, watch.noise, watch.neededFall, kind, watch.status].join(" ");
}

/** What the core of `module` finds in the streams, { path: text }. */
export async function trace(module, streams) {
  const { EventDetector } = await (await import(module)).load();
  const lines = [];
  for (const [path, content] of Object.entries(streams)) {
    lines.push(`case ${path}`);
    const watch = new EventDetector();
    let kept;
    for (const line of content.trim().split("\n")) {
      if (line === "keep") kept = watch.snapshot();
      else if (line === "restore") lines.push(watch.restore(kept) ? "taken" : "refused");
      else if (line === "reset") watch.reset();
      else lines.push(step(watch, line.split(" ")));
    }
  }
  return `${lines.join("\n")}\n`;
}

if (typeof process !== "undefined") {
  const { readFileSync } = await import("node:fs");
  const { pathToFileURL } = await import("node:url");
  const [module, ...paths] = process.argv.slice(2);
  const streams = Object.fromEntries(paths.map((path) => [path, readFileSync(path, "utf8")]));
  process.stdout.write(await trace(pathToFileURL(module).href, streams));
}
