// The engine in a worker: every message is what a row is to hold, the answer a run with all that is shown of it.
let engine = null;
const TURNS = 8; // drive periods of the moving picture, the last ones of the run

/** Times of a run: of the moving picture, and of the figures over the stretch that they show; both increase, and so do all. */
function timesOf({ end, period, frames, points, seen: [from, to] }) {
  const whole = Math.max(Math.floor((end / period) * (1 + 1e-9)), 0), shown = Math.min(TURNS, whole) * period;
  const [start, last] = shown > 0 && shown < end ? [whole * period - shown, Math.min(whole * period, end)] : [0, end];
  const even = (count, a, b) => Float64Array.from({ length: count }, (_, n) => a + ((b - a) * n) / (count - 1));
  const film = even(frames, start, last), chart = even(points, Math.max(from, 0), Math.min(to, end));
  return { film, chart, all: Float64Array.from(new Set([...film, ...chart])).sort() };
}

/** Rows of numbers as columns, one behind the other. */
function columnsOf(rows, width) {
  const count = width ? rows.length / width : 0, out = new Float64Array(rows.length);
  for (let k = 0, at = 0; k < width; k++) for (let n = 0; n < count; n++) out[at++] = rows[n * width + k];
  return out;
}

function run({ row, place, end: asked, ...shown }) {
  for (const [name, places, value] of row) for (const at of places) engine.array(name)[at] = value;
  const parts = (name) => {
    const from = engine.array(`lattice.${name}`), to = engine.array(`rows.${name}`);
    to.set(from.subarray(place * to.length, (place + 1) * to.length));
  };
  parts("channels");
  parts("shown");
  parts("drawn");
  const period = engine.array("lattice.periods")[place], end = Math.min(asked, engine.duration);
  engine.array("rows.scales")[2] = period;
  const times = timesOf({ end, period, ...shown }), found = engine.run(times.all, true, end);
  return { ...found, period, end, times, frames: columnsOf(found.frames, found.seenWidth) };
}

async function answer(data) {
  if (data.module) {
    engine = new Engine(data.module, await data.packet.arrayBuffer());
    return;
  }
  if (!engine) return; // why was said
  const begun = performance.now(), found = run(data);
  const moved = [found.frames, found.events, found.measures, found.times.all, found.times.film].map(({ buffer }) => buffer);
  postMessage({ ...found, took: performance.now() - begun }, moved);
}

let before = Promise.resolve(); // one message after the other: the first waits for its packet
onmessage = ({ data }) => {
  before = before.then(() => answer(data)).catch(({ message }) => postMessage({ failed: message }));
};
