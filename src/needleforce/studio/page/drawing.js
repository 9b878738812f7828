// SPDX-License-Identifier: Apache-2.0
// What the drawings share: colours of the page, ticks, a canvas that is sharp on every screen, and a context that
// writes SVG with the calls of a canvas, so that one function makes screen, PNG and SVG.

export const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "Liberation Sans", Arial, sans-serif';
const LIGHT = {
  ink: "#1c2126", quiet: "#5d666f", line: "#e2e4e6", paper: "#ffffff", a: "#b84800", b: "#0067a5",
  stiffness: "#00795a", friction: "#8a4a9c", cutting: "#8a6a00", tissue: "#f3d9cd", deeper: "#e8c0ad", cut: "#a3523a",
  needle: "#8d979f", edge: "#4b545b",
};
const DARK = {
  ink: "#e8eaec", quiet: "#a2abb3", line: "#343a40", paper: "#16191c", a: "#ff9a52", b: "#62b8f5",
  stiffness: "#3ecf9f", friction: "#d39be3", cutting: "#e2bd4a", tissue: "#4a352d", deeper: "#5d4136", cut: "#d98a6c",
  needle: "#9aa5ad", edge: "#d5dbe0",
};

const dark = matchMedia("(prefers-color-scheme: dark)");
const { documentElement: root } = document;

/** The theme of the page around, be it a site, JupyterLab or Visual Studio Code; nothing if it has chosen none. */
function chosenTheme() {
  const { jpThemeLight, vscodeThemeKind } = document.body.dataset;
  return root.dataset.theme || { true: "light", false: "dark" }[jpThemeLight] || vscodeThemeKind;
}

export function colours() {
  const theme = chosenTheme();
  return (theme ? theme.includes("dark") : dark.matches) ? DARK : LIGHT;
}

/** Acts when the colours change; returns what ends that. */
export function onColours(act) {
  const observer = new MutationObserver(act);
  observer.observe(root, { attributeFilter: ["data-theme"] });
  dark.addEventListener("change", act);
  return () => {
    observer.disconnect();
    dark.removeEventListener("change", act);
  };
}

/** Places of ticks over a range, about `apart` pixels from each other, and their texts. */
export function ticks(low, high, pixels, apart) {
  const rough = ((high - low) * apart) / pixels;
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = ten * [1, 2, 5, 10].find((each) => each * ten >= rough * 0.999);
  const places = Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9)));
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; ++n)
    found.push([n * step, (n * step + 0).toFixed(places).replace("-", "−")]);
  return found;
}

/** Draws on a canvas at the size that it has on the page; nothing while it is hidden. */
export function paint(canvas, draw) {
  const { clientWidth: width, clientHeight: height } = canvas;
  if (!width || !height) return;
  const ratio = window.devicePixelRatio || 1;
  const [across, down] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== across || canvas.height !== down) [canvas.width, canvas.height] = [across, down];
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = FONT;
  draw(context, { width, height }, colours());
}

/** The drawings side by side in one picture: [{ draw, width, height, x, y }]. */
function composed(context, parts) {
  for (const { draw, width, height, x, y } of parts) {
    context.save();
    context.translate(x, y);
    context.font = FONT;
    draw(context, { width, height }, LIGHT);
    context.restore();
  }
}

export function pngOf(parts, width, height) {
  const canvas = Object.assign(document.createElement("canvas"), { width: 2 * width, height: 2 * height });
  const context = canvas.getContext("2d");
  context.scale(2, 2);
  context.fillStyle = LIGHT.paper;
  context.fillRect(0, 0, width, height);
  composed(context, parts);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}

export function svgOf(parts, width, height) {
  const context = new SvgContext();
  composed(context, parts);
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${width} ${height}" width="${width}" height="${height}">` +
    `<rect width="100%" height="100%" fill="${LIGHT.paper}"/>${context.text()}</svg>\n`;
}

const two = (value) => String(Math.round(100 * value) / 100);
const escaped = (text) => String(text).replace(/[&<>"]/g, (one) => `&#${one.charCodeAt(0)};`);
const STATE = ["fillStyle", "strokeStyle", "lineWidth", "textAlign", "textBaseline", "globalAlpha", "font", "dash"];

/** The part of a canvas's context that the drawings use, written as SVG. */
class SvgContext {
  fillStyle = "#000"; strokeStyle = "#000"; lineWidth = 1; textAlign = "left"; textBaseline = "alphabetic";
  globalAlpha = 1; font = FONT; dash = "";
  #parts = []; #stack = []; #open = 0; #path = ""; #clips = 0;

  text() { return this.#parts.join(""); }
  save() {
    this.#stack.push([this.#open, STATE.map((name) => this[name])]);
    this.#open = 0;
  }
  restore() {
    this.#parts.push("</g>".repeat(this.#open));
    const [open, values] = this.#stack.pop();
    this.#open = open;
    STATE.forEach((name, i) => { this[name] = values[i]; });
  }
  #group(attributes) {
    this.#parts.push(`<g ${attributes}>`);
    this.#open += 1;
  }
  translate(x, y) { this.#group(`transform="translate(${two(x)} ${two(y)})"`); }
  rotate(angle) { this.#group(`transform="rotate(${two((180 * angle) / Math.PI)})"`); }
  setLineDash(lengths) { this.dash = lengths.join(" "); }
  beginPath() { this.#path = ""; }
  moveTo(x, y) { this.#path += `M${two(x)} ${two(y)}`; }
  lineTo(x, y) { this.#path += `L${two(x)} ${two(y)}`; }
  quadraticCurveTo(a, b, x, y) { this.#path += `Q${two(a)} ${two(b)} ${two(x)} ${two(y)}`; }
  closePath() { this.#path += "Z"; }
  rect(x, y, width, height) { this.#path += `M${two(x)} ${two(y)}h${two(width)}v${two(height)}h${two(-width)}Z`; }
  arc(x, y, radius) { // whole circles alone
    const half = (way) => `a${two(radius)} ${two(radius)} 0 1 0 ${two(way)} 0`;
    this.#path += `M${two(x - radius)} ${two(y)}${half(2 * radius)}${half(-2 * radius)}Z`;
  }
  clip() {
    const name = `clip${++this.#clips}`;
    this.#parts.push(`<clipPath id="${name}"><path d="${this.#path}"/></clipPath>`);
    this.#group(`clip-path="url(#${name})"`);
  }
  stroke() {
    const dash = this.dash && ` stroke-dasharray="${this.dash}"`;
    this.#parts.push(`<path d="${this.#path}" fill="none" stroke="${this.strokeStyle}" stroke-width="${two(this.lineWidth)}"` +
      ` stroke-linejoin="round" opacity="${this.globalAlpha}"${dash}/>`);
  }
  fill() { this.#parts.push(`<path d="${this.#path}" fill="${this.fillStyle}" opacity="${this.globalAlpha}"/>`); }
  fillRect(x, y, width, height) {
    const box = `x="${two(x)}" y="${two(y)}" width="${two(width)}" height="${two(height)}"`;
    this.#parts.push(`<rect ${box} fill="${this.fillStyle}" opacity="${this.globalAlpha}"/>`);
  }
  fillText(text, x, y) {
    const anchor = { left: "start", center: "middle", right: "end" }[this.textAlign];
    const lower = { top: 10, middle: 4, bottom: -3, alphabetic: 0 }[this.textBaseline];
    const weight = /^(\d{3}) /.exec(this.font)?.[1] ?? 400;
    this.#parts.push(`<text x="${two(x)}" y="${two(y + lower)}" text-anchor="${anchor}" fill="${this.fillStyle}" font-weight="${weight}"` +
      ` font-size="12" font-family="system-ui, sans-serif">${escaped(text)}</text>`);
  }
  measureText(text) { return { width: 6.4 * text.length }; }
}
