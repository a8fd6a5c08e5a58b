// Draws the figures over time of a page with uPlot, from the data next to them; asks nothing of any network.
(() => {
"use strict";
const root = document.documentElement;
const colors = new Map(); // as the page's theme has them: to ask the page at every line costs more than to draw it
function color(name) {
  if (!colors.has(name)) colors.set(name, getComputedStyle(root).getPropertyValue(`--${name}`).trim());
  return colors.get(name);
}
addEventListener("themechange", () => colors.clear());

/** Numbers of a packed column; null where there is none. */
function column({ bits, low, step, data }) {
  const raw = Uint8Array.from(atob(data), (character) => character.charCodeAt(0));
  if (bits === 32) return Array.from(new Float32Array(raw.buffer));
  const whole = bits === 16 ? new Uint16Array(raw.buffer) : raw, none = 2 ** bits - 1;
  return Array.from(whole, (q) => (q === none ? null : (low + q) * step));
}

/** A number with as many digits as steps of its axis have. */
const digits = (step) => (`${Number(step.toPrecision(3))}`.split(".")[1] || "").length;
const tick = (value, step) => minus((Math.abs(value) < 1e-9 * step ? 0 : value).toFixed(digits(step)));

/** Numbers in units of a step; null where there is none. */
function scaled(values, step) {
  const out = new Array(values.length);
  for (let n = 0; n < values.length; n++) out[n] = Number.isFinite(values[n]) ? values[n] / step : null;
  return out;
}

class Charts {
  constructor(figure) {
    this.figure = figure;
    this.spec = JSON.parse(figure.querySelector(".charts-data").textContent);
    this.x = this.spec.x.map(column);
    this.whole = this.spec.window;
    this.told = `${this.whole}`; // the stretch that was last shown
    this.face = getComputedStyle(figure).fontFamily;
    this.panels = [...figure.querySelectorAll(".panel")];
    this.now = figure.querySelector(".now");
    this.key = uPlot.sync(`charts${Charts.count++}`);
    this.room = 50;
    this.plots = this.spec.panels.map((panel, i) => this.plot(panel, i));
    this.waiting = this.panels.map(() => null); // numbers of panels that are out of sight
    this.inSight = this.panels.map(() => true);
    const sight = new IntersectionObserver((seen) => seen.forEach(({ target, isIntersecting }) => {
      const i = this.panels.indexOf(target);
      this.inSight[i] = isIntersecting;
      if (isIntersecting) this.put(i);
    }));
    this.panels.forEach((panel) => sight.observe(panel));
    this.panels.forEach((_, i) => this.keys(i));
    if (this.room > 50) this.plots.forEach((plot) => plot.redraw(false, true));
    this.listen();
  }

  /** Other numbers in place of those of the page [SI]: the times of all lines, and of each panel its lines' values, what is shaded and its bars. */
  take(time, panels) {
    const x = scaled(time, this.spec.step);
    this.waiting = panels.map((panel) => ({ x, ...panel }));
    this.panels.forEach((_, i) => this.inSight[i] && this.put(i));
  }

  /** Draws what waits for a panel. */
  put(i) {
    const waits = this.waiting[i], plot = this.plots[i], own = this.spec.panels[i], { min, max } = plot.scales.x;
    if (!waits) return;
    const spans = (of) => of.map(([a, b]) => [a / this.spec.step, b / this.spec.step]);
    this.waiting[i] = null;
    if (waits.shaded) own.shaded = spans(waits.shaded);
    waits.bars?.forEach((of, k) => { own.bars[k].spans = spans(of); });
    plot.setData([waits.x, ...waits.lines.map((line) => scaled(line, own.step))], false);
    plot.setScale("x", { min, max });
    this.keys(i);
  }

  /** Names stand for lines that have numbers. */
  keys(i) {
    const drawn = this.plots[i].data.map((row) => row.some(Number.isFinite));
    for (const key of this.panels[i].querySelectorAll("button[data-lines]")) key.hidden = !key.dataset.lines.split(" ").some((line) => drawn[line]);
  }

  /** The stretch that is seen [SI]. */
  get seen() {
    const { min, max } = this.plots[0].scales.x;
    return [min * this.spec.step, max * this.spec.step];
  }

  plot(panel, i) {
    const host = this.panels[i].querySelector(".plot"), last = i === this.spec.panels.length - 1;
    const font = `12px ${this.face}`;
    const names = panel.names.length ? panel.names : null;
    const axis = { font, stroke: () => color("muted"), ticks: { stroke: () => color("rule"), width: 1, size: 4 } };
    const plot = new uPlot({
      width: host.clientWidth, height: panel.height,
      padding: [6, 18, last ? 0 : 6, 0],
      legend: { show: false },
      cursor: { y: false, sync: { key: this.key.key }, drag: { x: true, y: false }, points: { size: 6 } },
      scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: { dir: this.flipped(panel) ? -1 : 1, range: (_, low, high) => this.reach(panel, low, high) } },
      axes: [
        { ...axis, show: last, gap: 3, size: 26, space: (_, __, ___, ____, room) => (room < 250 ? 34 : 50), grid: { show: false },
          values: (_, marks, __, ___, step) => marks.map((v) => tick(v, step)) },
        { ...axis, size: (_, words) => this.wide(words), gap: 4, space: panel.height < 120 ? 18 : 26,
          ...(names ? { splits: () => names.map((_, at) => at), values: () => names, grid: { show: false }, ticks: { show: false }, space: 0,
            font: names.length > 12 ? `10px ${this.face}` : font }
            : { grid: { stroke: () => color("rule"), width: 0.5 }, values: (_, marks, __, ___, step) => marks.map((v) => tick(v, step)) }) },
      ],
      series: [{}, ...panel.series.map(({ stroke, width, dash }) => ({ stroke: () => color(stroke), width, dash, points: { size: 4 } }))],
      hooks: {
        drawClear: [(u) => this.under(u, panel)],
        setScale: [(u, key) => key === "x" && this.share(u.scales.x)],
        setCursor: [(u) => this.read(u, i)],
      },
    }, [this.x[panel.x], ...panel.series.map((line) => column(line.values))], host);
    plot.over.setAttribute("aria-hidden", "true");
    if (this.spec.clock) plot.over.addEventListener("click", () => dispatchEvent(new CustomEvent("seek", { detail: plot.posToVal(plot.cursor.left, "x") * this.spec.step })));
    plot.setScale("x", { min: this.whole[0], max: this.whole[1] });
    return plot;
  }

  /** Room for the words of the upward axes, one for all panels: as much as the longest so far needs. */
  wide(words) {
    const longest = Math.max(0, ...(words || []).map((one) => (one || "").length));
    const room = Math.max(this.room, between(7 * longest + 14, 50, 120));
    if (room > this.room && this.plots) queueMicrotask(() => this.plots.forEach((plot) => plot.redraw(false, true)));
    this.room = room;
    return room;
  }

  /** Whether an upward axis counts downward, as rows of a table do. */
  flipped({ limits: [least, most] }) {
    return least !== null && most !== null && least > most;
  }

  /** Limits of an upward axis about what is seen. */
  reach(panel, low, high) {
    const [least, most] = this.flipped(panel) ? [panel.limits[1], panel.limits[0]] : panel.limits;
    const known = low !== null && high !== null && Number.isFinite(low) && Number.isFinite(high);
    const [a, b] = known ? [low, high] : [0, 1], room = 0.06 * (b - a || Math.abs(b) || 1);
    return [least === null ? a - room : least, most === null ? b + room : most];
  }

  /** What lies below the lines: stretches shaded, bars, level lines. */
  under(u, panel) {
    const { ctx, bbox } = u, { min, max } = u.scales.x, sharp = devicePixelRatio || 1;
    const across = (x) => u.valToPos(between(x, min, max), "x", true), up = (y) => u.valToPos(y, "y", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    const fill = (start, end, top, bottom) => {
      if (end < min || start > max) return;
      const left = across(start);
      ctx.fillRect(left, top, Math.max(across(end) - left, 0.75 * sharp), bottom - top);
    };
    ctx.fillStyle = color("contact");
    for (const [start, end] of panel.shaded) fill(start, end, bbox.top, bbox.top + bbox.height);
    for (const bar of panel.bars) {
      ctx.fillStyle = color(bar.color);
      const [a, b] = [up(bar.low), up(bar.high)];
      for (const [start, end] of bar.spans) fill(start, end, Math.min(a, b), Math.max(a, b));
    }
    for (const level of panel.levels) {
      ctx.strokeStyle = color(level.color);
      ctx.lineWidth = 0.7 * sharp;
      ctx.setLineDash(level.dash.map((part) => part * sharp));
      ctx.beginPath();
      ctx.moveTo(bbox.left, up(level.at));
      ctx.lineTo(bbox.left + bbox.width, up(level.at));
      ctx.stroke();
    }
    ctx.restore();
  }

  /** Panels of one figure show one stretch of time. */
  share({ min, max }) {
    if (!this.plots || this.told === `${[min, max]}`) return;
    this.told = `${[min, max]}`;
    for (const plot of this.plots) plot.setScale("x", { min, max });
    this.figure.dispatchEvent(new Event("zoom"));
  }

  /** Puts the cursor at the time [s] that the page's moving picture shows; below a pointer it is the reader's. */
  mark(time) {
    if (this.figure.matches(":hover")) return;
    this.plots.forEach((plot, i) => this.inSight[i] && plot.setCursor({ left: plot.valToPos(time / this.spec.step, "x"), top: 0 }, true, false));
  }

  /** What lines of one name show at the cursor. */
  read(u, i) {
    const { idx } = u.cursor, none = idx === null || idx === undefined;
    for (const out of this.panels[i].querySelectorAll("output")) {
      const lines = none ? [] : (out.dataset.lines || out.parentNode.dataset.lines).split(" ");
      out.textContent = plain(lines.map((line) => u.data[line][idx]).find((value) => value !== null && value !== undefined));
    }
    if (i === 0) this.now.textContent = none ? "" : `: ${plain(u.data[0][idx])}`;
  }

  listen() {
    this.panels.forEach((panel, i) => {
      for (const button of panel.querySelectorAll("button[data-lines]")) {
        button.addEventListener("click", () => {
          const on = button.getAttribute("aria-pressed") !== "true";
          button.setAttribute("aria-pressed", on);
          for (const line of button.dataset.lines.split(" ")) this.plots[i].setSeries(Number(line), { show: on });
        });
      }
    });
    for (const button of this.figure.querySelectorAll("[data-zoom]")) {
      button.addEventListener("click", () => this.zoom(button.dataset.zoom));
    }
    addEventListener("themechange", () => this.plots.forEach((plot) => plot.redraw(false, true)));
    if (this.spec.clock) addEventListener("walktime", ({ detail }) => this.mark(detail));
    addEventListener("beforeprint", () => { this.panels.forEach((_, i) => this.put(i)); this.fit(640); });
    addEventListener("afterprint", () => this.fit());
    new ResizeObserver(() => this.fit()).observe(this.figure);
  }

  fit(most = Infinity) {
    this.plots.forEach((plot, i) => {
      const width = Math.min(this.panels[i].clientWidth, most);
      if (width > 0 && width !== plot.width) plot.setSize({ width, height: this.spec.panels[i].height });
    });
  }

  zoom(how) {
    const { min, max } = this.plots[0].scales.x, [start, end] = this.whole;
    const span = max - min, next = { in: 0.5 * span, out: Math.min(2 * span, end - start), all: end - start }[how] || span;
    const centre = 0.5 * (min + max) + ({ back: -0.5, on: 0.5 }[how] || 0) * span;
    const first = between(centre - 0.5 * next, start, end - next);
    this.plots[0].setScale("x", { min: first, max: first + next });
  }
}
Charts.count = 0;

const build = (figure) => { if (!figure.built) figure.built = new Charts(figure); };
document.querySelectorAll(".charts").forEach(build);
})();
