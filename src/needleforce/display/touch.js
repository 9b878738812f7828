// SPDX-License-Identifier: Apache-2.0
// Drawings that zoom and show their values: drag or wheel, double click for the whole; arrow keys, + - 0 after a click or Tab.
// canvas.py names the parts: data-panel (box, limits, both axes), data-curve (name), data-ticks, data-label (directions in
// which a text follows the data). A panel's view is the part of its box that is shown, so that paths are their own data.
(() => {
  const PAIR = /(-?[\d.]+) (-?[\d.]+)/g, AXES = [0, 1], panels = [];
  const digits = (value, step) => value.toFixed(Math.max(0, Math.min(9, Math.ceil(-Math.log10(step) - 1e-9)))).replace("-", "−");
  const sorted = (pair) => [...pair].sort((a, b) => a - b);
  const between = (value, [low, high]) => Math.min(high, Math.max(low, value));
  const tip = document.createElement("div");
  tip.className = "values";
  tip.setAttribute("role", "status");
  tip.style.cssText = "position:fixed;display:none;pointer-events:none;z-index:9;padding:5px 9px;border-radius:4px;white-space:pre;" +
    "font:13px/1.45 system-ui,sans-serif;color:#1c2126;background:#fffffff0;box-shadow:0 0 0 1px #c4c9ce";
  const hide = () => { tip.style.display = "none"; panels.forEach((each) => each.over.replaceChildren()); };

  class Panel {
    constructor(group) {
      const [box, limits, ...names] = group.dataset.panel.split("|"), svg = group.ownerSVGElement;
      const [left, top, right, bottom] = box.split(" ").map(Number), [x0, x1, y0, y1] = limits.split(" ").map(Number);
      Object.assign(this, { group, svg, names, limits: [[x0, x1], [y0, y1]], box: [[left, right], [bottom, top]] });
      const clipped = (name) => [...group.querySelectorAll(name)].filter((each) => !each.closest("[data-ticks]"));
      this.parts = [...clipped("path[clip-path]").map((one) => ({ one, low: 0 })), ...clipped("[clip-path] use").map((one) => this.used(one))];
      this.parts.forEach((part) => { part.d = part.one.getAttribute("d"); });
      this.texts = [...group.querySelectorAll("[data-label] > text[x]")].map((one) => (
        { one, at: ["x", "y"].map((name) => +one.getAttribute(name)), follows: ["x", "y"].map((name) => one.parentNode.dataset.label.includes(name)) }));
      this.curves = [...group.querySelectorAll("[data-curve] > path[clip-path]")].map((one) => (
        { name: one.parentNode.dataset.curve, colour: one.style.stroke, points: [...one.getAttribute("d").matchAll(PAIR)].map((p) => [+p[1], +p[2]]) })).filter((each) => each.points.length > 2);
      this.scale = group.insertBefore(this.make("g"), group.children[1]);
      this.over = group.appendChild(this.make("g", { "pointer-events": "none" }));
      this.whole();
    }
    used(one) {  // markers are moved; a filled range is a path that is used further down
      const [x, y] = [+one.getAttribute("x"), +one.getAttribute("y")];
      return x ? { one, x, y } : { one: this.svg.getElementById(one.getAttribute("xlink:href").slice(1)), low: y };
    }
    make(name, attributes = {}, text = "") {
      const one = document.createElementNS(this.svg.namespaceURI, name);
      Object.entries(attributes).forEach(([key, value]) => one.setAttribute(key, value));
      one.textContent = text;
      return one;
    }
    whole() { this.view = this.box.map((pair) => [...pair]); }
    map(value, [a, b], [c, d]) { return c + (value - a) / (b - a) * (d - c); }
    value(k, place) { return this.map(place, this.box[k], this.limits[k]); }
    place(k, value) { return this.map(value, this.limits[k], this.box[k]); }
    shown(k, place) { return this.map(place, this.view[k], this.box[k]); }
    behind(k, shown) { return this.map(shown, this.box[k], this.view[k]); }
    inside(k, shown, margin = 0) { const [low, high] = sorted(this.box[k]); return shown >= low - margin && shown <= high + margin; }
    draw() {
      const all = `${this.view}` === `${this.box}`, at = (k, place, low = 0) => (this.shown(k, place + low) - low).toFixed(2);
      for (const { one, d, low, x, y } of this.parts) {
        if (d) one.setAttribute("d", all ? d : d.replace(PAIR, (_, x, y) => `${at(0, +x)} ${at(1, +y, low)}`));
        else one.setAttribute("x", at(0, x)), one.setAttribute("y", at(1, y));
      }
      for (const { one, at, follows } of this.texts) {
        const now = AXES.map((k) => follows[k] ? this.shown(k, at[k]) : at[k]);
        now.forEach((value, k) => one.setAttribute("xy"[k], value));
        one.style.display = AXES.every((k) => all || !follows[k] || this.inside(k, now[k], 4)) ? "" : "none";
      }
      this.group.querySelectorAll("[data-ticks]").forEach((each) => { each.style.display = all ? "" : "none"; });
      this.scale.replaceChildren(...(all ? [] : AXES.flatMap((k) => this.ticks(k))));
    }
    ticks(k) {
      const [low, high] = sorted(this.view[k].map((place) => this.value(k, place))), [left, right] = this.box[0], [bottom, top] = this.box[1];
      const rough = (high - low) * (k ? 36 / (bottom - top) : 64 / (right - left)), ten = 10 ** Math.floor(Math.log10(rough));
      const step = ten * [1, 2, 5, 10].find((each) => each * ten >= rough), first = Math.ceil(low / step), found = [];
      for (let n = first; n * step <= high; n++) {
        const at = this.shown(k, this.place(k, n * step)), end = k ? { x: left - 3.5, y: at + 3, "text-anchor": "end" } : { x: at, y: bottom + 13, "text-anchor": "middle" };
        if (k) found.push(this.make("path", { d: `M${left} ${at}H${right}`, stroke: "#e8e8e6", "stroke-width": 0.7 }));
        found.push(this.make("text", { ...end, "font-size": 8.5, fill: "#222222" }, digits(n * step, step)));
      }
      return found;
    }
    zoom(windows) {  // panels of a drawing with the same axis and limits stay the same
      for (const other of panels.filter((each) => each.svg === this.svg)) {
        for (const k of AXES.filter((k) => windows[k] && other.names[k] === this.names[k] && `${other.limits[k]}` === `${this.limits[k]}`)) {
          const [low, high] = sorted(windows[k].map((place) => between(this.map(place, this.box[k], [0, 1]), [0, 1])));
          if (high - low > 1e-4) other.view[k] = [low, high].map((share) => this.map(share, [0, 1], other.box[k]));
        }
        other.draw();
      }
    }
    scaled(factor, spot) { this.zoom(AXES.map((k) => this.view[k].map((end) => end + (1 - factor) * (this.behind(k, spot[k]) - end)))); }
    sample(curve, index) {
      const [x, y] = curve.points[index];
      return { panel: this, curve, index, x, y, u: this.shown(0, x), v: this.shown(1, y) };
    }
    nearest([u, v]) {  // the sample of each curve next to a place, rather along the axis than across; the nearest curve first
      const far = (one) => this.inside(0, one.u, 0.1) ? 4 * (one.u - u) ** 2 + (one.v - v) ** 2 : Infinity;
      const found = this.curves.map((curve) => curve.points.map((_, index) => this.sample(curve, index)).reduce((a, b) => far(b) < far(a) ? b : a));
      return found.filter((one) => far(one) < Infinity).sort((a, b) => far(a) - far(b));
    }
    words(k, place) {
      const [, name, unit = ""] = this.names[k].match(/^(.*?)(?: \[(.*)\])?$/), [a, b] = this.view[k].map((each) => this.value(k, each));
      return [name, `${digits(this.value(k, place), Math.abs(b - a) / 500)}${unit && unit !== "1" ? ` ${unit}` : ""}`];
    }
    show(found) {
      const frame = this.svg.getBoundingClientRect(), size = frame.width / this.svg.viewBox.baseVal.width, [first] = found;
      tip.replaceChildren(this.words(0, first.x).join(" "), ...found.slice(0, 6).map(({ curve, y }) => {
        const [row, dot, bold] = ["div", "span", "b"].map((name) => document.createElement(name)), [name, value] = this.words(1, y);
        [dot.textContent, dot.style.color, bold.textContent] = ["● ", curve.colour, value];
        row.append(dot, `${curve.name || name} `, bold);
        return row;
      }));
      tip.style.display = "block";
      const left = frame.left + first.u * size + 14, over = left + tip.offsetWidth > innerWidth - 4 ? tip.offsetWidth + 28 : 0;
      tip.style.left = `${Math.max(4, left - over)}px`;
      tip.style.top = `${between(frame.top + first.v * size - tip.offsetHeight - 10, [4, innerHeight - tip.offsetHeight - 4])}px`;
      for (const other of panels) {  // a cursor in every panel over the same quantity
        const x = other.shown(0, other.place(0, this.value(0, first.x))), seen = other.names[0] === this.names[0] && other.inside(0, x);
        const line = seen ? [other.make("path", { d: `M${x} ${other.box[1][0]}V${other.box[1][1]}`, stroke: "#6d7278", "stroke-width": 0.6 })] : [];
        other.over.replaceChildren(...line);
      }
      this.over.append(...found.map(({ u, v, curve }) => this.make("circle", { cx: u, cy: v, r: 2.6, fill: curve.colour, stroke: "#fff" })));
    }
  }

  function listen(svg, own) {
    let from = null, at = null;  // where a drag began; the sample under the cursor
    const on = (name, act, options) => svg.addEventListener(name, act, options);
    const spotOf = ({ clientX, clientY }) => { const { x, y } = new DOMPoint(clientX, clientY).matrixTransform(svg.getScreenCTM().inverse()); return [x, y]; };
    const under = (spot) => own.find((each) => AXES.every((k) => each.inside(k, spot[k], 4)));
    const chosen = (to) => AXES.map((k) => Math.abs(to[k] - from.spot[k]) < 12 ? null : [from.spot[k], to[k]]);  // a thin rectangle is of one axis
    const look = (panel, found) => { if (found.length) [at] = found, panel.show(found); };
    const reset = () => { own.forEach((each) => { each.whole(); each.draw(); }); hide(); };
    svg.tabIndex = 0;
    svg.style.cssText += ";cursor:crosshair;touch-action:pan-y pinch-zoom;user-select:none";
    on("pointerdown", (event) => { const spot = spotOf(event), panel = under(spot); from = panel && !event.button ? { panel, spot } : null; });
    on("pointermove", (event) => {
      const spot = spotOf(event), panel = from ? from.panel : under(spot);
      if (!panel) return hide();
      look(panel, panel.nearest(spot));
      if (!from) return;
      const [[x0, x1], [y0, y1]] = chosen(spot).map((pair, k) => sorted((pair || panel.box[k]).map((each) => between(each, sorted(panel.box[k])))));
      panel.over.append(panel.make("rect", { x: x0, y: y0, width: x1 - x0, height: y1 - y0, fill: "#0072b2", opacity: 0.15 }));
    });
    addEventListener("pointerup", (event) => {
      const windows = from && chosen(spotOf(event));
      if (windows?.some(Boolean)) from.panel.zoom(windows.map((pair, k) => pair?.map((each) => from.panel.behind(k, each)))), hide();
      from = null;
    });
    Object.entries({ pointercancel() { from = null; }, pointerleave() { if (!from) hide(); }, blur: hide, dblclick: reset }).forEach((each) => on(...each));
    on("wheel", (event) => {  // scrolls the page until the drawing was clicked
      const spot = spotOf(event), panel = under(spot);
      if (!panel || !(event.ctrlKey || document.activeElement === svg)) return;
      event.preventDefault();
      panel.scaled(event.deltaY < 0 ? 0.8 : 1.25, spot);
      look(panel, panel.nearest(spot));
    }, { passive: false });
    on("keydown", (event) => {
      const every = own.flatMap((panel) => panel.curves.map((curve) => ({ panel, curve }))), move = { ArrowRight: 1, ArrowLeft: -1 }[event.key] || 0;
      const turn = { ArrowDown: 1, ArrowUp: -1 }[event.key] || 0, factor = { "+": 0.8, "-": 1.25 }[event.key], last = at || own[0].sample(own[0].curves[0], 0);
      if (event.key === "0" || event.key === "Escape") return reset();
      if (!move && !turn && !factor) return;
      event.preventDefault();
      if (factor) last.panel.scaled(factor, [last.u, last.v]);
      const { panel, curve } = every[(every.findIndex((each) => each.curve === last.curve) + turn + every.length) % every.length], end = curve.points.length - 1;
      const index = turn ? Math.round(last.index / (last.curve.points.length - 1) * end) : last.index + move * (event.shiftKey ? 10 : 1);
      look(panel, [panel.sample(curve, between(index, [0, end]))]);
    });
  }

  for (const svg of [...document.querySelectorAll("svg:not([tabindex])")].filter((each) => each.querySelector("[data-panel]"))) {
    const own = [...svg.querySelectorAll("[data-panel]")].map((group) => new Panel(group)).filter((each) => each.curves.length);
    panels.push(...own);
    if (own.length) listen(svg, own);
  }
  if (panels.length) document.body.append(tip);
  document.head.append(Object.assign(document.createElement("style"), { textContent: "@media print { .values, [data-panel] > g[pointer-events] { display: none !important } }" }));
})();
