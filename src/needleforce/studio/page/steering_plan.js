// SPDX-License-Identifier: Apache-2.0
// A plan of the package's own planner, which the studio's server runs in a process: a line of JSON for some of its
// evaluations, the last one is the plan. Who aborts ends the process.

const GONE = "The server does not answer: it was stopped. Start needleforce studio again.";
const ENDED = "The planner's process ended without a plan. The memory may not suffice.";

async function* linesOf(body) {
  const decoder = new TextDecoder();
  let rest = "";
  for (const reader = body.getReader(); ;) {
    const { value, done } = await reader.read();
    if (done) return;
    const lines = (rest + decoder.decode(value, { stream: true })).split("\n");
    rest = lines.pop();
    yield* lines;
  }
}

/** The plan; `onProgress` is given the number of evaluations. Throws an Error in words, or an AbortError. */
export async function askPlan(question, signal, onProgress) {
  let last = null;
  try {
    const answer = await fetch("plans", { method: "POST", body: JSON.stringify(question), signal });
    if (!answer.ok) throw new TypeError(answer.statusText);
    for await (const text of linesOf(answer.body)) {
      last = JSON.parse(text);
      if ("count" in last) onProgress(last.count);
    }
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Error(GONE, { cause: error });
  }
  if (!last || "count" in last) throw new Error(ENDED);
  if (last.error) throw new Error(last.error);
  return last;
}
