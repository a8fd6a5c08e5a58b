// Draws an atlas: a map of classes or of a measure, to pan, zoom and read; asks nothing of any network.
(() => {
"use strict";
const host = document.getElementById("atlas"), spec = JSON.parse(host.querySelector(".atlas-data").textContent);
const find = (name) => host.querySelector(`.atlas-${name}`), canvas = find("map"), what = find("what");
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const bytes = (text) => Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
const clamp = (value, least, most) => Math.min(Math.max(value, least), most);
const n = spec.size, last = n - 1, [ax, ay] = spec.axes;

// which run each point has its class from: its own, or that of the lower corner of its square
const bits = bytes(spec.known), source = new Int32Array(n * n).fill(-1), place = [];
for (let i = 0, run = 0; i < n * n; i++) if (bits[i >> 3] & (128 >> (i & 7))) { source[i] = run++; place.push(i); }
for (let step = spec.coarse >> 1; step >= 1; step >>= 1) {
  const even = ~(2 * step - 1);
  for (let x = 0; x < n; x += step) for (let y = 0; y < n; y += step)
    if (source[x * n + y] < 0) source[x * n + y] = source[(x & even) * n + (y & even)];
}
const own = bytes(spec.own);
const measures = spec.measures.map(({ bits, low, step, data }) => {
  const raw = bytes(data), whole = bits === 16 ? new Uint16Array(raw.buffer) : raw, none = 2 ** bits - 1;
  return Float64Array.from(whole, (q) => (q === none ? NaN : (low + q) * step));
});

// colours: classes are told apart, measures go from dark to light
const KINDS = ["#56b4e9", "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#f0e442", "#7b3fa0", "#8fd19e", "#a6761d", "#f4a6c0", "#274b8f"];
const OPEN = { chaotic: "#3a3a3a", "not settled": "#8a8a8a" };
const RAMP = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121], [110, 206, 88], [181, 222, 43], [253, 231, 37]];
const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
// beyond as many classes as there are colours: the same ones paler, then darker
const ROUNDS = [[0, 0], [255, 0.6], [0, 0.5]];
function kind(i) {
  const [to, share] = ROUNDS[Math.floor(i / KINDS.length) % ROUNDS.length];
  return `#${rgb(KINDS[i % KINDS.length]).map((one) => Math.round(one + share * (to - one)).toString(16).padStart(2, "0")).join("")}`;
}
let used = 0;
const colours = spec.classes.map((one) => (one.open ? OPEN[one.name] || "#c8c8c8" : kind(used++)));
const LINES = ["c-vermilion", "ink", "c-purple", "c-green", "c-blue"], line = (i) => style(LINES[i % LINES.length]);
const ramp = (share) => {
  const at = clamp(share, 0, 1) * (RAMP.length - 1), i = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[i].map((value, k) => Math.round(value + (at - i) * (RAMP[i + 1][k] - value)));
};

// numbers for reading
const minus = (text) => text.replace("-", "−"), SI = { "-12": "p", "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M" };
const PREFIXED = new Set(["m", "m/s", "V", "N", "N/s", "s", "Hz", "J", "N/m", "F"]);
const unit = (text) => (text === "1" ? "" : ` ${text.replaceAll("^2", "²").replaceAll("^3", "³")}`);
function amount(value, of, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value), power = size ? clamp(3 * Math.floor(Math.log10(size * (1 + 1e-9)) / 3), -12, 6) : 0;
  if (size && PREFIXED.has(of)) return `${minus(`${Number((value / 10 ** power).toPrecision(digits))}`)} ${SI[power]}${of}`;
  const plain = size === 0 || (size >= 1e-3 && size < 1e5);
  const [mantissa, ten] = value.toExponential(digits - 1).split("e").map(Number);
  const raised = minus(`${ten}`).replace(/./g, (sign) => (sign === "−" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(sign)]));
  return minus(plain ? `${Number(value.toPrecision(digits))}` : `${mantissa === 1 ? "" : `${mantissa}·`}10${raised}`) + unit(of);
}
/** Of a tick: its unit where that takes a prefix, else it stands beside the name of the axis. */
const tick = (value, axis) => amount(value, PREFIXED.has(axis.unit) ? axis.unit : "1", 5);
const title = (axis) => (PREFIXED.has(axis.unit) || axis.unit === "1" ? axis.name : `${axis.name} [${unit(axis.unit).trim()}]`);
const at = (axis, share) => (axis.log ? axis.from * (axis.to / axis.from) ** share : axis.from + share * (axis.to - axis.from));
const shareOf = (axis, value) => (axis.log ? Math.log(value / axis.from) / Math.log(axis.to / axis.from) : (value - axis.from) / (axis.to - axis.from));
function ticks(axis, low, high, most) {
  const from = at(axis, low), to = at(axis, high), out = [];
  if (axis.log && to / from > 30) {
    const every = Math.ceil(Math.log10(to / from) / most);
    for (let p = Math.ceil(Math.log10(from) - 1e-9); 10 ** p <= to * (1 + 1e-9); p += every) out.push(10 ** p);
    return out;
  }
  const rough = (to - from) / most, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((one) => one * power >= rough);
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to * (1 + 1e-9); k++) out.push(k * step);
  return out;
}

// the map as a picture of one pixel a point, y upwards
const picture = document.createElement("canvas"), ink = picture.getContext("2d");
picture.width = picture.height = n;
let ends = [0, 1];
function paint() {
  const image = ink.createImageData(n, n), pixels = new Uint32Array(image.data.buffer), k = Number(what.value);
  const pack = ([r, g, b]) => (255 << 24) | (b << 16) | (g << 8) | r;
  let each;
  if (k < 0) { const packed = colours.map((one) => pack(rgb(one))); each = Uint32Array.from(own, (one) => packed[one]); }
  else {
    const sorted = measures[k].filter(Number.isFinite).sort(), part = (q) => sorted[Math.round(q * (sorted.length - 1))];
    ends = [part(0.01), part(0.99)];
    const none = pack(rgb("#c8c8c8")), span = ends[1] - ends[0] || 1;
    each = Uint32Array.from(measures[k], (value) => (Number.isFinite(value) ? pack(ramp((value - ends[0]) / span)) : none));
  }
  for (let x = 0; x < n; x++) for (let y = 0; y < n; y++) pixels[(last - y) * n + x] = each[source[x * n + y]];
  ink.putImageData(image, 0, 0);
  legend(k);
}
function legend(k) {
  const box = find("legend"), add = (html) => { const one = document.createElement("span"); one.innerHTML = html; box.append(one); return one; };
  box.replaceChildren();
  if (k < 0) spec.classes.forEach((one, i) => { add(`<i style="background:${colours[i]}"></i>${one.name} (${(100 * one.share).toPrecision(3)} %)`); });
  else {
    const { unit: of, about } = spec.measures[k];
    add(amount(ends[0], of, 3));
    const bar = document.createElement("canvas"), pen = bar.getContext("2d");
    bar.width = 256; bar.height = 1;
    bar.setAttribute("aria-hidden", "true"); // its ends are told beside it
    for (let i = 0; i < 256; i++) { pen.fillStyle = `rgb(${ramp(i / 255)})`; pen.fillRect(i, 0, 1, 1); }
    box.append(bar);
    add(`${amount(ends[1], of, 3)} or more: ${about}`);
  }
  spec.overlays.forEach((one, i) => { add(`<i class="${one.marks ? "mark" : "line"}" style="color:${line(i)}"></i>`).append(one.name); });
}

// what of the map is seen: view = [low x, low y, share of the axes that is seen]
let view = [0, 0, 1], cursor = null, width = 1, height = 1;
const LEFT = 62, BOTTOM = 38, TOP = 8, RIGHT = 12, pen = canvas.getContext("2d");
const toX = (share) => LEFT + ((share - view[0]) / view[2]) * (width - LEFT - RIGHT);
const toY = (share) => TOP + (1 - (share - view[1]) / view[2]) * (height - TOP - BOTTOM);
const fromX = (px) => view[0] + ((px - LEFT) / (width - LEFT - RIGHT)) * view[2];
const fromY = (py) => view[1] + (1 - (py - TOP) / (height - TOP - BOTTOM)) * view[2];
function fit() {
  const ratio = devicePixelRatio || 1;
  [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw();
}
function draw() {
  const w = width - LEFT - RIGHT, h = height - TOP - BOTTOM, half = 0.5 / last;
  pen.clearRect(0, 0, width, height);
  pen.save();
  pen.beginPath(); pen.rect(LEFT, TOP, w, h); pen.clip();
  pen.imageSmoothingEnabled = false;
  const [x0, x1, y0, y1] = [toX(-half), toX(1 + half), toY(1 + half), toY(-half)];
  pen.drawImage(picture, x0, y0, x1 - x0, y1 - y0);
  spec.overlays.forEach((one, i) => {
    pen.strokeStyle = line(i); pen.lineWidth = 1.8;
    for (const places of one.lines) {
      if (one.marks) for (const [x, y] of places) { pen.beginPath(); pen.arc(toX(x), toY(y), 3.5, 0, 7); pen.stroke(); }
      else { pen.beginPath(); places.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](toX(x), toY(y))); pen.stroke(); }
    }
  });
  if (cursor) {
    const [x, y] = [toX(cursor[0] / last), toY(cursor[1] / last)], size = Math.max(w / (last * view[2]), 7);
    pen.lineWidth = 3; pen.strokeStyle = "#fff"; pen.strokeRect(x - size / 2, y - size / 2, size, size);
    pen.lineWidth = 1; pen.strokeStyle = "#000"; pen.strokeRect(x - size / 2, y - size / 2, size, size);
  }
  pen.restore();
  pen.strokeStyle = style("rule"); pen.lineWidth = 1; pen.strokeRect(LEFT, TOP, w, h);
  pen.fillStyle = style("muted"); pen.font = `12px ${getComputedStyle(canvas).fontFamily}`;
  pen.textAlign = "center"; pen.textBaseline = "top";
  for (const value of ticks(ax, view[0], view[0] + view[2], w < 420 ? 4 : 7)) pen.fillText(tick(value, ax), clamp(toX(shareOf(ax, value)), LEFT, width - 24), height - BOTTOM + 5);
  pen.fillText(title(ax), LEFT + w / 2, height - BOTTOM + 21, w);
  pen.textAlign = "right"; pen.textBaseline = "middle";
  for (const value of ticks(ay, view[1], view[1] + view[2], 6)) pen.fillText(tick(value, ay), LEFT - 5, toY(shareOf(ay, value)), LEFT - 20);
  pen.save(); pen.translate(8, TOP + h / 2); pen.rotate(-Math.PI / 2); pen.textAlign = "center"; pen.fillText(title(ay), 0, 0, h); pen.restore();
}
function say() {
  const [x, y] = cursor, run = source[x * n + y], from = place[run], here = from === x * n + y;
  const [px, py] = here ? [x, y] : [Math.floor(from / n), from % n];
  const numbers = spec.measures.map((one, k) => [one, measures[k][run]]).filter(([, value]) => Number.isFinite(value));
  find("says").textContent = `${ax.name} ${amount(at(ax, x / last), ax.unit)}, ${ay.name} ${amount(at(ay, y / last), ay.unit)}: ${spec.classes[own[run]].name}` +
    (here ? "" : ` (as at ${amount(at(ax, px / last), ax.unit)}, ${amount(at(ay, py / last), ay.unit)})`) +
    `; ${numbers.map(([one, value]) => `${one.name} ${amount(value, one.unit)}`).join(", ")}.`;
}
function name() {
  const [x, y] = cursor, settled = spec.measures.findIndex((one) => one.name === "settled after");
  const values = [[ax, x], [ay, y]].map(([axis, k]) => `--set ${axis.path}=${Number(at(axis, k / last).toPrecision(15))}`);
  const long = settled >= 0 && measures[settled][source[x * n + y]];
  const lasts = spec.period ? ` --duration ${Number(((Number.isFinite(long) ? long : 120) * spec.period + 20 * spec.period).toPrecision(6))}s` : "";
  find("run").hidden = false;
  find("run").firstChild.textContent = `tarsus simulate scene.toml ${values.join(" ")}${lasts}`;
}

// looking around
function zoom(factor, x = view[0] + view[2] / 2, y = view[1] + view[2] / 2) {
  const size = clamp(view[2] * factor, Math.min(1, 8 / last), 1), kept = size / view[2];
  move(x - (x - view[0]) * kept, y - (y - view[1]) * kept, size);
}
function move(x, y, size = view[2]) { view = [clamp(x, 0, 1 - size), clamp(y, 0, 1 - size), size]; draw(); }
function point(event) {
  const box = canvas.getBoundingClientRect(), [x, y] = [fromX(event.clientX - box.left), fromY(event.clientY - box.top)];
  return [clamp(x, 0, 1), clamp(y, 0, 1)];
}
function hover(share) { cursor = share.map((one) => Math.round(one * last)); say(); draw(); }
const fingers = new Map();
let dragged = 0;
canvas.addEventListener("pointerdown", (event) => { fingers.set(event.pointerId, event); dragged = 0; canvas.setPointerCapture(event.pointerId); });
canvas.addEventListener("pointermove", (event) => {
  const before = fingers.get(event.pointerId);
  if (!before) { hover(point(event)); return; }
  const other = [...fingers.values()].find((one) => one.pointerId !== event.pointerId);
  dragged += Math.abs(event.clientX - before.clientX) + Math.abs(event.clientY - before.clientY);
  if (other) {
    const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
    zoom(apart(before) / apart(event), ...point(other));
  } else if (dragged > 4) {
    const a = point(before), b = point(event);
    move(view[0] + a[0] - b[0], view[1] + a[1] - b[1]);
  }
  fingers.set(event.pointerId, event);
});
for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => {
  fingers.delete(event.pointerId);
  if (kind === "pointerup" && dragged <= 4) { hover(point(event)); name(); }
});
canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(clamp(event.deltaY, -200, 200) / 400), ...point(event)); }, { passive: false });
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
canvas.addEventListener("keydown", (event) => {
  const by = MOVES[event.key];
  if (by) {
    const start = cursor || [0, 1].map((k) => Math.round((view[k] + view[2] / 2) * last)), far = event.shiftKey ? 16 : 1;
    const next = start.map((one, k) => clamp((one + far * by[k]) / last, 0, 1));
    if (next.some((one, k) => one < view[k] || one > view[k] + view[2])) move(next[0] - view[2] / 2, next[1] - view[2] / 2);
    hover(next);
  } else if (event.key === "+" || event.key === "=") zoom(0.5, ...(cursor || []).map((one) => one / last));
  else if (event.key === "-") zoom(2);
  else if (event.key === "0") move(0, 0, 1);
  else if (event.key === "Enter" && cursor) name();
  else return;
  event.preventDefault();
});
host.querySelectorAll("[data-do]").forEach((button) => button.addEventListener("click", () => {
  ({ in: () => zoom(0.5), out: () => zoom(2), all: () => move(0, 0, 1) })[button.dataset.do]();
}));
what.append(new Option("classes", -1), ...spec.measures.map((one, k) => new Option(one.name, k)));
what.addEventListener("change", () => { paint(); draw(); });
addEventListener("themechange", () => { paint(); draw(); });
new ResizeObserver(fit).observe(canvas);
paint();
fit();
})();
