// SPDX-License-Identifier: Apache-2.0
// The same streams through WebAssembly, called as trace.mjs.
const ODD = { nan: NaN, inf: Infinity, "-inf": -Infinity };
const NAMES = ["modulus", "cutting", "friction", "top", "puncture", "remainder"];
const number = (word) => ODD[word] ?? Number(word);

function priorOf([punctures, same, radius, half_angle, spacing, ...rest]) {
  const part = (at) => ({ mean: rest[at], sd: rest[at + 1] });
  const layers = [0, 12].map((from) => Object.fromEntries(NAMES.map((name, i) => [name, part(from + 2 * i)])));
  const earlier = { spacing, mean: rest.slice(24, 185), sd: rest.slice(185) };
  return { layers, punctures, same_tissue: same !== 0, radius, tip: { name: "cone", half_angle }, earlier };
}

function row(online, event) {
  const { value, sd } = online.surface;
  const numbers = [online.innovation, value, sd];
  for (const layer of [online.layer(0), online.layer(1)]) {
    for (const name of NAMES.slice(0, 3)) numbers.push(layer[name].value, layer[name].sd);
    numbers.push(layer.puncture_depth, layer.puncture_force);
  }
  const ahead = online.ahead(2e-3);
  for (const i of [0, 5, 10]) numbers.push(ahead.force[i], ahead.low[i], ahead.high[i]);
  numbers.push(ahead.puncture_probability, ahead.puncture_depth, online.pierced);
  return [...numbers, event?.kind ?? "none", online.regime, online.status].join(" ");
}

/** What the core of `module` learns from the streams, { path: text }. */
export async function trace(module, streams) {
  const { OnlineIdentifier } = await (await import(module)).load();
  const lines = [];
  for (const [path, content] of Object.entries(streams)) {
    lines.push(`case ${path}`);
    let online = new OnlineIdentifier(), kept, samples = 0;
    for (const line of content.trim().split("\n")) {
      const words = line.split(" ");
      if (words[0] === "prior") online = new OnlineIdentifier(priorOf(words.slice(1).map(number)));
      else if (line === "keep") kept = online.snapshot();
      else if (line === "restore") lines.push(online.restore(kept) ? "taken" : "refused");
      else if (line === "reset") online.reset();
      else {
        const event = online.step(...words.map(number));
        if (++samples % 20 === 0 || event) lines.push(row(online, event));
      }
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
