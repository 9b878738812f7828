// SPDX-License-Identifier: Apache-2.0
// How a file is read, and is to be read: its first rows with the quantity, unit and sign of each column in lists, its
// parts, and the other options of reading as the server's table has them. All that comes from a file is set as text.

import { element, words } from "./controls.js";

const USUAL = { time: "s", depth: "mm", velocity: "mm/s", force: "N" }; // where a sign is reversed and no unit is known
const IN_LISTS = ["columns", "units", "inwards", "part", "motion_part"]; // options that have lists of their own
const MOST_DIGITS = 6;

const option = (value, text, selected) => element("option", { value, selected }, text);
const labelled = (text, control, title = "") => element("label", { className: "inline", title }, `${text} `, control);

/** The options in words for a list, with what stands for none. */
function choice(name, values, chosen, none) {
  return element("select", { "aria-label": name }, option("", none, !chosen),
    ...values.map(([value, text]) => option(value, text, String(value) === String(chosen ?? ""))));
}

/**
 * Fills `place` with the panel of a file.
 *
 * @param {HTMLElement} place - where it is shown
 * @param {{name, look, options, motion}} file - with what the server found in it
 * @param {{options, quantities, inwards}} offered - by the server
 * @param {{name, key}[]} others - files that may hold the motion
 * @param {function({options, motion, all})} onRead - takes the choices; `all` for those of every file
 */
export function showColumns(place, file, offered, others, onRead) {
  const { look, options } = file;
  const columns = look.columns.map((column, k) => columnControls(column, k, file, offered));
  const part = choice("part of the file", [["all", "all"], ...look.parts.map((name, k) => [name || k + 1, name || `number ${k + 1}`]),
    ["cycle *", "each cycle"]], options.part, look.parts.length > 1 ? "choose" : "the whole");
  const tables = (look.tables ?? []).filter((name) => name);
  const table = choice("table with the motion", tables.map((name) => [name, name]), options.motion_part, "the same");
  const inwards = choice("depth during insertion", offered.inwards.map((name) => [name, name]), options.inwards, "as the data show");
  const motion = choice("motion", others.map(({ id, name }) => [id, name]), file.motion, "in this file");
  const further = furtherControls(offered.options, options);
  const all = element("input", { type: "checkbox", checked: others.some((one) => one.look?.state === "unread") && look.state === "unread" });
  const read = element("button", { type: "button", id: "read-again" }, "Read it like this");
  read.addEventListener("click", () => {
    const made = { ...further(), ...chosenColumns(columns, options) };
    if (part.value) made.part = part.value;
    if (inwards.value) made.inwards = inwards.value;
    if (table.value) made.motion_part = table.value;
    onRead({ options: made, motion: motion.value || null, all: all.checked });
  });
  const forget = element("button", { type: "button" }, "As found");
  forget.addEventListener("click", () => onRead({ options: {}, motion: null, all: all.checked }));
  place.replaceChildren(
    element("h2", {}, "How ", element("em", {}, file.name), " is read"),
    ...(look.problem ? [element("p", { className: "why", role: "alert" }, look.problem)] : []),
    ...(look.assumed?.length ? [element("ul", { className: "about" }, ...look.assumed.map((text) => element("li", {}, `Assumed: ${text}`)))] : []),
    ...(columns.length ? [firstRows(look.columns, columns)] : []),
    element("div", { className: "bar" },
      ...(look.parts.length ? [labelled("Part", part)] : []),
      ...(tables.length > 1 ? [labelled("Depth in the table", table)] : []),
      labelled("Depth during insertion", inwards),
      ...(others.length ? [labelled("Motion", motion)] : []),
      ...(others.length ? [labelled("for all files", all)] : []), read, forget),
    further.place,
  );
}

/** Quantity, unit and sign of a column. */
function columnControls({ header, unit, quantity }, k, file, { quantities }) {
  const { columns = {}, units = {} } = file.options;
  const given = Object.entries(columns).find(([, value]) => String(value) === String(k + 1) || value === header)?.[0];
  const likely = Object.entries(file.look.likely ?? {}).find(([, number]) => number === String(k + 1))?.[0] ?? "";
  const found = given ?? (Object.keys(columns).includes(quantity) ? "" : quantity);
  const name = `column ${k + 1}`;
  const role = choice(`quantity of ${name}`, Object.keys(quantities).map((each) => [each, each]), found || likely, "not used");
  const measured = element("select", { "aria-label": `unit of ${name}` });
  const reversed = element("input", { type: "checkbox", "aria-label": `sign of ${name} reversed` });
  const sign = element("label", { className: "inline" }, reversed, " reversed");
  const fill = () => {
    const own = units[role.value] ?? "";
    const listed = quantities[role.value] ?? [];
    const chosen = own.replace(/^-/, "");
    const extra = chosen && !listed.includes(chosen) ? [chosen] : [];
    measured.replaceChildren(option("", unit ? `${unit}, as stated` : "as found", !chosen),
      ...[...extra, ...listed].map((each) => option(each, each, each === chosen)));
    reversed.checked = own.startsWith("-");
    measured.disabled = !role.value;
    sign.hidden = !["force", "velocity"].includes(role.value);
  };
  fill();
  role.addEventListener("change", fill);
  return { role, measured, reversed, sign, found, unit, number: k + 1 };
}

/** Columns and units as options, where they differ from what was found. */
function chosenColumns(controls, before) {
  const used = controls.filter(({ role }) => role.value);
  const changed = before.columns || controls.some(({ role, found }) => role.value !== found);
  const columns = Object.fromEntries(used.map(({ role, number }) => [role.value, number]));
  const units = {};
  for (const { role, measured, reversed, unit } of used) {
    const minus = reversed.checked && !["time", "depth"].includes(role.value);
    if (measured.value || minus) units[role.value] = `${minus ? "-" : ""}${measured.value || unit || USUAL[role.value]}`;
  }
  return { ...(changed && used.length ? { columns } : {}), ...(Object.keys(units).length ? { units } : {}) };
}

function firstRows(columns, controls) {
  const row = (cells) => element("tr", {}, ...cells.map((cell) => element("td", {}, cell)));
  const count = Math.max(0, ...columns.map(({ head }) => head.length));
  const number = (value) => (value === null || value === undefined ? "" : String(Number(value.toPrecision(MOST_DIGITS))).replace("-", "−"));
  const rows = Array.from({ length: count }, (_, i) => row(columns.map(({ head }) => number(head[i]))));
  return element("div", { className: "scroll" }, element("table", { className: "rows" },
    element("thead", {}, element("tr", {}, ...columns.map(({ header }, k) => element("th", { scope: "col" }, header || `column ${k + 1}`)))),
    element("tbody", {}, row(controls.map(({ role }) => role)), row(controls.map(({ measured }) => measured)),
      row(controls.map(({ sign }) => sign)), ...rows)));
}

/** The options without a list, a field each; called, it gives those that are filled. */
function furtherControls(rows, options) {
  const fields = rows.filter(({ key }) => !IN_LISTS.includes(key)).map((row) => {
    const value = row.kind === "table" ? Object.entries(options[row.key] ?? {}).map((pair) => pair.join("=")).join(", ") : options[row.key] ?? "";
    const input = element("input", { type: "text", value: String(value), autocomplete: "off", "aria-label": row.key, id: `read-${row.key}` });
    return { row, input };
  });
  const control = ({ row, input }) => element("label", { title: row.help }, words(row.key), input, element("small", {}, row.help));
  const given = () => Object.fromEntries(fields.filter(({ input }) => input.value.trim()).map(({ row, input }) => [row.key, valueOf(row.kind, input.value.trim())]));
  const open = fields.some(({ input }) => input.value);
  given.place = element("details", { open }, element("summary", {}, "Files without time or depth, and other options"),
    element("div", { className: "further" }, ...fields.map(control)));
  return given;
}

/** What was written into a field; a number that is none is left to the server, which refuses it in words. */
function valueOf(kind, text) {
  if (kind === "table") return Object.fromEntries(text.split(",").map((pair) => pair.split("=").map((each) => each.trim())).map(([key, value = ""]) => [key, value]));
  const number = Number(text.replace(",", "."));
  return kind === "text" || Number.isNaN(number) ? text : number;
}
