// An explorer: sliders that change a run of the engine in this page; asks nothing of any network.

const FRAMES = 360, MOVING = { frames: 120, points: 0.4, ms: 8 }, WIDTH = 12, KIND = 2, MOST_ROWS = 200, ROUNDING = 1e-9, REST = 120;
const FORGETS = 0.9; // share of the slowest pace that is left with the next move: a slow place is remembered for a dozen
const TIME = 0, FOOT = 1, BEFORE = 3, AFTER = 4, PULL = 5, ENERGY = 7;

/** The bytes of a script element: base64 of what was compressed. */
async function unpacked(element) {
  const raw = Uint8Array.from(atob(element.textContent), (character) => character.charCodeAt(0));
  return new Response(new Blob([raw]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

function made(tag, parts = {}, ...children) {
  const element = Object.assign(document.createElement(tag), parts);
  element.append(...children);
  return element;
}

/** One slider: its value [SI] by its place, which is a number of steps from its low end or the number of a stop. */
class Slider {
  constructor(about, turned) {
    Object.assign(this, about);
    this.own = this.value;
    this.most = this.stops ? this.stops.length - 1 : 400;
    this.input = made("input", { type: "range", min: 0, max: this.most, step: 1 });
    this.out = made("output");
    this.back = made("button", { type: "button", textContent: "↺", title: "Back to the scene's own value", hidden: true });
    this.back.setAttribute("aria-label", `${this.name}: back to the scene's own value`);
    this.input.setAttribute("aria-label", this.name);
    this.input.addEventListener("input", () => { this.value = this.at(Number(this.input.value)); this.show(); turned(true); });
    this.back.addEventListener("click", () => { this.put(this.own); turned(); });
    const label = made("span", { className: "explore-name", textContent: this.name, title: `${this.paths[0]}: ${this.doc}` });
    this.root = made("div", { className: "explore-slider" }, label, this.out, this.back, this.input);
    this.put(this.own);
  }

  /** The value at a place, of four digits so that it can be written down. */
  at(place) {
    if (this.stops) return this.stops[place];
    const share = place / this.most, { low, high } = this;
    const value = this.log ? low * (high / low) ** share : low + (high - low) * share;
    return between(Number(value.toPrecision(4)), low, high);
  }

  put(value) {
    this.value = this.stops ? this.stops.reduce((a, b) => (Math.abs(b - value) < Math.abs(a - value) ? b : a)) : between(value, this.low, this.high);
    const { low, high } = this, share = this.log ? Math.log(this.value / low) / Math.log(high / low) : (this.value - low) / (high - low);
    this.input.value = this.stops ? this.stops.indexOf(this.value) : Math.round(share * this.most);
    this.show();
  }

  show() {
    this.out.textContent = amount(this.value, this.unit, 4);
    this.input.setAttribute("aria-valuetext", this.out.textContent);
    this.back.hidden = !this.moved;
  }

  get moved() {
    return this.value !== this.own;
  }
}

/** The engine in a worker of its own, which runs one row at a time. */
class Runner {
  /** what: the worker's address, the module and the packet; answered(data, asked): what came of a question, or failed. */
  constructor(what, answered) {
    Object.assign(this, { what, answered, asked: null });
    this.begin();
  }

  get busy() {
    return this.asked !== null;
  }

  begin() {
    const { address, module, packet } = this.what, worker = new Worker(address);
    const told = (data) => { const { asked } = this; this.asked = null; this.answered(data, asked); };
    worker.onmessage = ({ data }) => told(data);
    worker.onerror = ({ message }) => told({ failed: message });
    worker.postMessage({ module, packet });
    this.worker = worker;
  }

  run(asked) {
    if (!this.worker) this.begin();
    this.asked = asked;
    this.worker.postMessage(asked);
  }

  /** Lets a run go of which nobody waits for the answer. */
  drop() {
    if (!this.busy) return;
    this.worker.terminate();
    this.worker = this.asked = null;
  }
}

class Explorer {
  constructor(root) {
    const part = (name) => root.querySelector(`.explore-${name}`);
    this.root = root;
    this.folded = root.closest("details"); // where it is opened first, as on the page of a run
    this.info = JSON.parse(part("info").textContent);
    for (const name of ["says", "desk", "measures", "tally", "events", "copied", "part", "freeze", "thaw", "reset"]) this[name] = part(name);
    this.turnable = this.info.sliders.map((about) => new Slider(about, (moving) => this.turned(moving)));
    for (const group of new Set(this.turnable.map((one) => one.group))) {
      this.desk.append(made("fieldset", {}, made("legend", { textContent: group }), ...this.turnable.filter((one) => one.group === group).map((one) => one.root)));
    }
    this.player = root.querySelector(".walk").player;
    this.charts = root.querySelector(".charts").built;
    this.turn = 0; // of the sliders: how often they were put elsewhere
    this.due = false; // a beginning, once the one that is run is there
    this.pace = 0; // of the worker [ms] for a second of a run, the slowest of late
    this.resting = null; // until the whole is asked for
    this.frozen = null;
    this.listen(part);
    this.start = () => this.begin(part);
    if (!this.folded) this.turned();
    else this.folded.addEventListener("toggle", () => this.start && this.turned());
  }

  /** Two workers: the beginning of a run, while a slider moves, never waits for a whole one. */
  async begin(part) {
    try {
      const [bytes, packet] = await Promise.all([unpacked(part("wasm")), unpacked(part("packet"))]);
      const code = new Blob([part("worker").textContent], { type: "text/javascript" });
      const what = { address: URL.createObjectURL(code), module: await WebAssembly.compile(bytes), packet: new Blob([packet]) };
      this.whole = new Runner(what, (data, asked) => this.answered(data, asked));
      this.live = new Runner(what, (data, asked) => this.answered(data, asked));
      this.askWhole();
    } catch (error) {
      this.say(`The engine did not start: ${error.message}. The page needs a browser of 2023 or later.`, true);
    }
  }

  listen(part) {
    this.freeze.addEventListener("click", () => { this.keeping = true; this.keep(); });
    this.thaw.addEventListener("click", () => { this.frozen = null; this.tell(); this.draw(); });
    this.reset.addEventListener("click", () => this.take({}));
    for (const how of ["line", "python"]) part(how).addEventListener("click", () => this.copy(this[how]()));
    this.charts.figure.addEventListener("zoom", () => this.shown && this.turned());
    addEventListener("message", ({ data, source }) => source === parent && parent !== window && data?.tarsus && this.take(data.tarsus));
    const reduced = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.player.again = true;
    if (!reduced && !this.folded) this.player.run();
  }

  /** Freezes what is shown, once it is the whole of where the sliders are. */
  keep() {
    if (!this.keeping || !this.settled) return;
    this.keeping = false;
    this.frozen = { ...this.shown, values: this.values };
    this.tell();
    this.draw();
  }

  get values() {
    return Object.fromEntries(this.turnable.filter((one) => one.moved).map((one) => [one.paths[0], one.value]));
  }

  /** Values by the first path of a slider; all others go back to the scene's own. */
  take(values) {
    for (const one of this.turnable) one.put(values[one.paths[0]] ?? one.own);
    this.turned();
  }

  /** The last position of the sliders counts: those passed while a run goes on are left out. While one moves the beginning
   *  of the run is shown, as much of it as is computed within some milliseconds, and the whole when it rests. */
  turned(moving = false) {
    this.turn++;
    clearTimeout(this.resting);
    this.resting = null;
    this.whole?.drop();
    this.start?.();
    this.start = null;
    if (!moving) return this.askWhole();
    this.due = true;
    this.ask();
    this.rest();
  }

  /** The whole run, once no slider has moved for a while and the beginning of the last one was shown. */
  rest() {
    this.resting = setTimeout(() => (this.due || this.live?.busy ? this.rest() : this.askWhole()), REST);
  }

  /** The beginning of the run where the sliders are now. */
  ask() {
    if (!this.live || this.live.busy || !this.due) return;
    this.due = false;
    const { charts: { seen }, info: { points } } = this;
    this.live.run({ ...this.row(), brief: true, seen, frames: MOVING.frames, points: Math.round(MOVING.points * points), end: this.reach(seen[1]) });
  }

  /** The whole run where the sliders are now. */
  askWhole() {
    this.resting = null;
    if (!this.whole) return; // it is asked for when all begins
    this.due = false;
    const { charts: { seen }, info: { points, seconds } } = this;
    this.whole.run({ ...this.row(), brief: false, seen, frames: FRAMES, points, end: seconds });
  }

  /** Where the sliders are: what the row of the packet is to hold. */
  row() {
    const row = this.turnable.filter((one) => !one.stops && one.turned === undefined).map((one) => [one.array, one.places, one.value]);
    row.push(...this.gravity());
    const place = this.turnable.filter((one) => one.stops).reduce((sum, one) => sum * one.stops.length + one.stops.indexOf(one.value), 0);
    return { turn: this.turn, begun: performance.now(), row, place };
  }

  /** Gravity into the ground and back along it, of its acceleration and the incline: see `gravity_on` of the library. */
  gravity() {
    const turning = this.turnable.filter((one) => one.turned !== undefined), falling = [...this.info.falling];
    if (!turning.length) return [];
    for (const one of turning) falling[one.turned] = one.value;
    const [acceleration, incline] = falling, [into, along] = turning[0].places;
    return [["rows.sources", [into], acceleration * Math.cos(incline)], ["rows.sources", [along], acceleration * Math.sin(incline)]];
  }

  /** How far a run goes while a slider moves [s]: 1, 2, 4 ... periods, so that it stays the same from move to move, and to the
   *  end of what the figures show of it. */
  reach(last) {
    const { pace, info: { seconds }, period = seconds } = this, one = Math.min(period, 0.25 * seconds);
    const far = one * 2 ** Math.max(Math.floor(Math.log2(MOVING.ms / (pace * one))), 0);
    return Math.min(last < (1 - ROUNDING) * seconds ? Math.max(far, last) : far, seconds);
  }

  answered(data, asked) {
    if (data.failed) {
      this.say(`The engine stopped: ${data.failed}. It was started anew; turn a slider to go on.`, true);
    } else {
      if (asked.brief || !this.pace) this.pace = Math.max(data.took / data.end, FORGETS * this.pace);
      this.period = data.period;
      this.ask(); // the engine goes on while this is drawn
      if (asked.turn > (this.shown?.turn ?? 0) || (asked.turn === this.shown.turn && !asked.brief)) this.show(data, asked);
    }
    this.ask();
  }

  show(data, { turn, brief, begun }) {
    this.shown = { ...this.read(data), turn };
    this.draw();
    this.tell();
    this.keep();
    this.root.dispatchEvent(new CustomEvent("shown", { detail: { ...data, turn, brief, whole: performance.now() - begun } }));
    if (parent !== window && this.settled) parent.postMessage({ tarsus: { values: this.values, measures: this.named(this.shown.measures) } }, "*");
  }

  /** What was run, by the names of its channels. */
  read({ frames, seenWidth, ...run }) {
    const count = seenWidth ? frames.length / seenWidth : 0, { events } = run, out = { ...run };
    let next = 0;
    for (const [name, many, rows] of this.info.columns) {
      const own = Array.from({ length: many }, () => frames.subarray(next * count, ++next * count));
      out[name] = rows ? own : own[0];
    }
    out.lost = new Float64Array(count);
    for (let n = 0, e = 0, sum = 0; n < count; n++) {
      for (; e < events.length && events[e + TIME] <= out.time[n]; e += WIDTH) sum += events[e + ENERGY];
      out.lost[n] = sum;
    }
    return out;
  }

  draw() {
    const { shown } = this;
    if (!shown || !shown.time.length) return;
    const film = this.film(shown);
    if (film) this.player.take(film);
    const { panels, feet } = this.info, held = feet.map((_, foot) => this.contacts(foot));
    this.charts.take(shown.time, panels.map(({ lines, bars }) => ({
      lines: lines.map(([of, k, frozen]) => this.series(of, k, frozen)), shaded: feet.length === 1 ? held[0] : null, bars: bars ? held : null,
    })));
  }

  series(of, k, frozen) {
    if (!frozen) return k === null ? this.shown[of] : this.shown[of][k];
    if (!this.frozen) return this.shown.time.map(() => NaN);
    const { time } = this.frozen, values = k === null ? this.frozen[of] : this.frozen[of][k];
    let at = 0;
    return this.shown.time.map((t) => {
      while (at + 1 < time.length && time[at + 1] <= t) at++;
      const next = Math.min(at + 1, time.length - 1), share = next > at ? between((t - time[at]) / (time[next] - time[at]), 0, 1) : 0;
      return values[at] + share * (values[next] - values[at]);
    });
  }

  /** Stretches of time in which a foot is on the ground. */
  contacts(foot) {
    const { time, contact } = this.shown, out = [];
    for (let n = 0, begun = null; n <= time.length; n++) {
      const held = n < time.length && contact[foot][n] !== 0;
      if (held && begun === null) begun = time[n];
      if (!held && begun !== null) { out.push([begun, time[Math.min(n, time.length - 1)]]); begun = null; }
    }
    return out;
  }

  /** Series of the moving picture, at its frames alone; none of a run that ended before the second. */
  film({ time, times, period, gap, contact, body, ...shown }) {
    const { legs } = this.info, at = [];
    for (let n = 0, k = 0; n < time.length && k < times.film.length; n++) if (time[n] === times.film[k]) { at.push(n); k++; }
    if (at.length < 2) return null;
    const none = new Float64Array(at.length);
    const taken = (series) => Float64Array.from(at, (n) => series[n]);
    const ofLeg = (series) => legs.map((foot) => (foot < 0 ? none : taken(series[foot])));
    const film = taken(time);
    return {
      frames: at.length, time: film, start: film[0], end: film[at.length - 1], period: period < film[at.length - 1] ? period : null,
      body: Object.fromEntries(this.info.body.map((name, k) => [name, taken(body[k])])),
      swing: ofLeg(shown.foot_x), footZ: ofLeg(gap), normal: ofLeg(shown.contact_force), friction: ofLeg(shown.friction_force),
      state: legs.map((foot) => Uint8Array.from(at, (n) => (foot < 0 ? 0 : contact[foot][n]))),
    };
  }

  /** Everything in words and numbers. */
  tell() {
    const { shown, frozen, info } = this;
    if (!shown) return;
    const foot = (k) => info.feet[k] ?? "";
    if (shown.code < 0) {
      const faults = [];
      for (let k = 0; k < shown.refusals.length; k += 4) faults.push(info.faults[shown.refusals[k + 1]].replace("{foot}", foot(shown.refusals[k + 2])).replace("{by}", amount(shown.refusals[k + 3], shown.refusals[k + 1] ? "N" : "m", 4)));
      this.say(`It cannot start so: ${faults.slice(0, 2).join("; ")}.`, true);
      return;
    }
    this.part.textContent = this.complete ? "" : `The first ${amount(shown.end, "s", 3)} while the slider moves; measures and events of the whole run when it rests.`;
    this.measures.classList.toggle("explore-waits", !this.complete);
    if (!this.complete) return;
    this.thaw.hidden = !frozen;
    this.freeze.textContent = frozen ? "Freeze this as A" : "Freeze as A";
    this.say(shown.code === 0 ? "" : `${info.codes[shown.code]} It ended at ${amount(shown.finish[0], "s", 4)}.`, shown.code !== 0);
    this.tellMeasures();
    clearTimeout(this.later); // long lists wait until the sliders rest
    this.later = setTimeout(() => this.tellEvents(), REST);
  }

  /** Whether what is shown is of the whole run; its figures may have fewer points. */
  get complete() {
    return this.shown.code < 0 || this.shown.end >= (1 - ROUNDING) * this.info.seconds;
  }

  /** Whether another answer is to come. */
  get busy() {
    return !this.whole || this.whole.busy || this.live.busy || this.due || this.resting !== null;
  }

  /** Whether what is shown is the whole run of where the sliders are. */
  get settled() {
    return Boolean(this.shown) && this.shown.turn === this.turn && this.complete;
  }

  named(measures) {
    return Object.fromEntries(this.info.measures.map(({ name }, k) => [name, Number.isFinite(measures[3 * k]) ? measures[3 * k] : null]));
  }

  tellMeasures() {
    const { shown, frozen, info } = this;
    const rows = info.measures.map(({ unit }, k) => {
      const [value, spread, n] = shown.measures.subarray(3 * k, 3 * k + 3), a = frozen?.measures[3 * k];
      const texts = [amount(value, unit, 5), n > 1 && spread > ROUNDING * Math.abs(value) ? amount(spread, unit, 2) : ""];
      if (!frozen) return texts;
      const change = value - a, share = a ? ` (${change > 0 ? "+" : ""}${Number(((100 * change) / Math.abs(a)).toPrecision(3))} %)`.replace("-", "−") : "";
      return [...texts, amount(a, unit, 5), change === 0 ? "0" : `${change > 0 ? "+" : ""}${amount(change, unit, 3)}${share}`];
    });
    if (this.told?.[0].length !== rows[0].length) this.told = this.table(rows[0].length);
    rows.forEach((texts, k) => texts.forEach((text, c) => { if (this.told[k][c].textContent !== text) this.told[k][c].textContent = text; }));
  }

  /** An empty table of the measures: the cells of its numbers, by row. */
  table(columns) {
    const cells = this.info.measures.map(() => Array.from({ length: columns }, () => made("td", { className: "n" })));
    const rows = this.info.measures.map(({ words, definition }, k) => made("tr", { className: "explore-measure" }, made("td", { textContent: words, title: definition }), ...cells[k]));
    const heads = ["measure", "value", "spread", ...(columns > 2 ? ["A", "change from A"] : [])];
    const head = made("tr", {}, ...heads.map((text, k) => made("th", { textContent: text, className: k ? "n" : "", scope: "col" })));
    this.measures.replaceChildren(made("table", {}, made("thead", {}, head), made("tbody", {}, ...rows)));
    return cells;
  }

  count({ events }) {
    const out = {};
    for (let e = 0; e < events.length; e += WIDTH) {
      const word = this.info.kinds[events[e + KIND]];
      if (word) out[word] = (out[word] ?? 0) + 1;
    }
    return out;
  }

  tellEvents() {
    const { shown, frozen, info } = this, now = this.count(shown), then = frozen ? this.count(frozen) : {};
    const words = [...new Set([...Object.keys(now), ...Object.keys(then)])];
    this.tally.textContent = words.length ? `${words.map((word) => `${now[word] ?? 0} × ${word}${frozen ? ` (A: ${then[word] ?? 0})` : ""}`).join(", ")}.` : "No foot touched the ground.";
    const rows = [];
    let left = 0;
    for (let e = 0; e < shown.events.length; e += WIDTH) {
      const at = shown.events.subarray(e, e + WIDTH), kind = info.kinds[at[KIND]];
      if (!kind) continue;
      if (rows.length >= MOST_ROWS) { left++; continue; }
      const landing = info.impacts.includes(at[KIND]);
      rows.push(made("tr", {}, ...[amount(at[TIME], "s", 7), info.feet[at[FOOT]], kind, landing ? amount(at[BEFORE], "m/s", 4) : "",
        landing ? amount(at[AFTER], "m/s", 4) : "", amount(at[PULL], "N", 4), landing ? amount(at[ENERGY], "J", 3) : ""]
        .map((text, k) => made("td", { textContent: text, className: k > 2 || k === 0 ? "n" : "" }))));
    }
    if (left) rows.push(made("tr", {}, made("td", { colSpan: 7, textContent: `and ${left} more` })));
    this.events.replaceChildren(...rows);
    this.events.closest(".table").hidden = !rows.length;
  }

  say(text, failed = false) {
    this.says.textContent = text;
    this.says.hidden = !text;
    this.says.className = `explore-says verdict${failed ? " failed" : ""}`;
  }

  /** What gives these numbers elsewhere: values as they are, in SI. */
  line() {
    const moved = this.turnable.filter((one) => one.moved).flatMap((one) => one.paths.map((path) => [path, `${one.value}${one.unit === "1" ? "" : ` ${one.unit}`}`]));
    const words = Object.entries({ ...this.info.words, ...Object.fromEntries(moved) });
    return [this.info.command, ...words.map(([path, text]) => `--set ${path}="${text}"`)].join(" ");
  }

  python() {
    const own = Object.entries(this.info.given), moved = this.turnable.filter((one) => one.moved).flatMap((one) => one.paths.map((path) => [path, one.value]));
    const values = Object.entries({ ...Object.fromEntries(own), ...Object.fromEntries(moved) }).map(([path, value]) => `    "${path}": ${value},\n`).join("");
    const scene = values ? `ts.with_values(${this.info.load}, {\n${values}})` : this.info.load;
    return `import tarsus as ts\n\nscene = ${scene}\nrun = ts.simulate(scene, ${this.info.seconds})\nprint(run.measures)`;
  }

  async copy(text) {
    this.copied.textContent = text;
    this.copied.hidden = false;
    getSelection().selectAllChildren(this.copied);
    try { await navigator.clipboard.writeText(text); } catch { document.execCommand("copy"); }
  }
}

addEventListener("DOMContentLoaded", () => document.querySelectorAll(".explore").forEach((root) => { root.explorer = new Explorer(root); }));
