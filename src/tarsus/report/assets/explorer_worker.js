// The engine in a worker: every message is what a row is to hold, the answer a run with all that is shown of it.
let engine = null;
const TURNS = 8; // drive periods of the moving picture, the last ones of the run

/** Times of a run: of the moving picture, and of the figures over the stretch that they show; both increase, and so do all. */
function timesOf({ end, period, frames, points, seen: [from, to] }) {
  const whole = Math.max(Math.floor((end / period) * (1 + 1e-9)), 0), shown = Math.min(TURNS, whole) * period;
  const [start, last] = shown > 0 && shown < end ? [whole * period - shown, whole * period] : [0, end];
  const even = (count, a, b) => Float64Array.from({ length: count }, (_, n) => a + ((b - a) * n) / (count - 1));
  const film = even(frames, start, last), chart = even(points, Math.max(from, 0), Math.min(to, end));
  return { film, chart, all: Float64Array.from(new Set([...film, ...chart])).sort() };
}

function run({ id, row, place, ...asked }) {
  for (const [name, places, value] of row) for (const at of places) engine.array(name)[at] = value;
  const parts = (name) => {
    const from = engine.array(`lattice.${name}`), to = engine.array(`rows.${name}`);
    to.set(from.subarray(place * to.length, (place + 1) * to.length));
  };
  parts("channels");
  parts("shown");
  const period = engine.array("lattice.periods")[place], end = engine.duration;
  engine.array("rows.scales")[2] = period;
  const times = timesOf({ end, period, ...asked });
  return { id, period, times, ...engine.run(times.all, true) };
}

onmessage = ({ data }) => {
  const begun = performance.now();
  try {
    if (data.module) {
      engine = new Engine(new WebAssembly.Module(data.module), data.packet);
      postMessage({ ready: true });
    } else {
      const found = run(data);
      postMessage({ ...found, took: performance.now() - begun });
    }
  } catch (error) {
    postMessage({ id: data.id, failed: error.message });
  }
};
