// SPDX-License-Identifier: Apache-2.0
// What the page and the server say to each other about recordings: files are sent, a fit of them is started, asked for
// and ended. A server that was started again has forgotten them: they are sent once more.

const ASKED_EVERY = 250; // [ms]
const AT_ONCE = 4; // files that are sent at a time
export const STOPPED = "The server does not answer: it was stopped. What was found stays on this page. Start needleforce studio " +
  "again, then press Identify: the recordings are sent once more.";

async function ask(path, options) {
  let answer;
  try {
    answer = await fetch(path, options);
  } catch {
    throw new Error(STOPPED);
  }
  return { status: answer.status, ...(await answer.json()) };
}

/** What the server offers to choose from. */
export const offered = () => ask("choices");

/** Sends the files that the server does not have yet; `onState` after each. A refused one has an `error`. */
async function send(files, onState) {
  const left = files.filter((file) => !file.key && file.file);
  const next = async () => {
    for (let one = left.shift(); one; one = left.shift()) {
      one.error = "";
      onState();
      const answer = await sent(one.file);
      if (answer.error) one.error = answer.error;
      else one.key = answer.key;
    }
  };
  await Promise.all(Array.from({ length: AT_ONCE }, next));
  onState();
}

const MAX_BYTES = 256 * 2 ** 20; // as the server, which would end the connection before the page reads why

async function sent(file) {
  if (file.size > MAX_BYTES)
    return { error: `${file.name} is too long for the page: ${Math.round(file.size / 2 ** 20)} MB, of 256. Identify it with needleforce identify.` };
  return ask(`recordings?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
}

function request(files, chosen) {
  const asked = files.map(({ key, options, motion, events }) => ({
    key, options, events, motion: files.find((one) => one.id === motion)?.key ?? "",
  }));
  return JSON.stringify({ ...chosen, files: asked });
}

/**
 * Starts a fit.
 *
 * @param {object[]} files - { id, name, file, key, options, motion, events } each; `key` is put in, or `error`
 * @param {{task, needle, model}} chosen - what is done
 * @param {function()} onState - after each file that was sent
 * @returns {Promise<string>} the key of the fit; throws an Error in words
 */
export async function start(files, chosen, onState) {
  await send(files, onState);
  let answer = { status: 404 };
  for (let tries = 0; tries < 2 && answer.status === 404; ++tries) {
    if (tries) {
      for (const one of files) [one.key, one.error] = [null, one.file ? "" : "The server has it no more: drop it again."];
      await send(files, onState);
    }
    const known = files.filter(({ key }) => key);
    if (!known.length) throw new Error("The server has none of these files: drop them again.");
    answer = await ask("fits", { method: "POST", body: request(known, chosen) });
  }
  if (answer.error) throw new Error(answer.error);
  return answer.key;
}

/** Asks how far a fit is until it has ended: { state, result }; `onState` takes what it does and what was read. */
export async function follow(key, onState) {
  for (let read = null; ;) {
    const answer = await ask(`fits/${key}${read ? "" : "?files"}`);
    if (answer.error) throw new Error(answer.error);
    if (answer.state !== "waiting" && answer.state !== "running") return answer;
    read = answer.read ?? read;
    onState(answer);
    await new Promise((done) => setTimeout(done, ASKED_EVERY));
  }
}

/** Ends a fit; also while the page is closed. */
export const cancel = (key) => ask(`fits/${key}`, { method: "DELETE", keepalive: true }).catch(() => {});
