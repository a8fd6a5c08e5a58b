// What a reader does with a page, and what of it must follow: functions that a test calls in the page.
(() => {
"use strict";
const passed = (ms) => new Promise((done) => setTimeout(done, ms));
const seen = (one) => one.checkVisibility() && !one.disabled;
const tell = (one, kind, more = {}) => one.dispatchEvent(new Event(kind, { bubbles: true, ...more }));
Element.prototype.setPointerCapture = () => {}; // of pointers that a script makes there is none

/** Numbers in [0, 1) by a seed: Lehmer's generator, of the minimal standard. */
function chance(seed) {
  let state = seed;
  return () => { state = (state * 48271) % 2147483647; return state / 2147483647; };
}

function pointer(one, kind, x, y, more = {}) {
  const box = one.getBoundingClientRect(), place = { clientX: box.left + x * box.width, clientY: box.top + y * box.height };
  const Kind = kind.startsWith("pointer") ? PointerEvent : MouseEvent;
  one.dispatchEvent(new Kind(kind, { bubbles: true, cancelable: true, pointerId: 1, button: 0, buttons: 1, ...place, ...more }));
}

const DOES = {
  "button, summary": (one) => one.click(),
  "input[type=range]": (one, random) => { one.value = Number(one.min) + random() * (Number(one.max) - Number(one.min)); tell(one, "input"); },
  "input[type=checkbox]": (one) => one.click(),
  select: (one, random) => { one.selectedIndex = Math.floor(random() * one.options.length); tell(one, "change"); },
  "main canvas": (one, random) => {
    const [x, y, z] = [random(), random(), random()];
    for (const [kind, at] of [["pointermove", x], ["pointerdown", x], ["pointermove", z], ["pointerup", z]]) pointer(one, kind, at, y, kind === "pointermove" && at === x ? { buttons: 0 } : {});
    const keys = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "+", "-", "0", "Enter"];
    one.dispatchEvent(new KeyboardEvent("keydown", { key: keys[Math.floor(random() * keys.length)], bubbles: true, cancelable: true }));
  },
  ".u-over": (one, random) => { // a stretch of a figure, drawn open or only pointed at
    const [x, z] = [random(), random()];
    pointer(one, "mouseenter", x, 0.5);
    pointer(one, "mousemove", x, 0.5);
    if (random() < 0.5) return;
    pointer(one, "mousedown", x, 0.5);
    pointer(one, "mousemove", z, 0.5);
    pointer(one, "mouseup", z, 0.5);
  },
};

/** So many interactions, each a kind of control by chance and one of its kind; how many of each kind were made. */
async function interact(count, seed) {
  const random = chance(seed), made = {};
  for (let n = 0; n < count; n++) {
    const there = Object.keys(DOES).map((kind) => [kind, [...document.querySelectorAll(kind)].filter(seen)]).filter(([, all]) => all.length);
    const [kind, all] = there[Math.floor(random() * there.length)];
    DOES[kind](all[Math.floor(random() * all.length)], random);
    made[kind] = (made[kind] ?? 0) + 1;
    if (n % 5 === 4) await passed(1);
  }
  return made;
}

/** A number that stands for what a canvas shows, 0 where that is one colour. */
function ink(canvas) {
  if (!canvas.width || !canvas.height) return 0;
  const pixels = new Uint32Array(canvas.getContext("2d", { willReadFrequently: true }).getImageData(0, 0, canvas.width, canvas.height).data.buffer);
  let sum = 0, plain = true;
  for (const pixel of pixels) { sum = (Math.imul(sum, 31) + pixel) | 0; plain &&= pixel === pixels[0]; }
  return plain ? 0 : sum || 1;
}

/** Plays every moving picture for a moment: those whose time, or what they show, stood still. */
async function play() {
  const faults = [];
  for (const figure of document.querySelectorAll(".walk")) {
    const canvas = figure.querySelector("canvas"), button = figure.querySelector(".walk-play");
    if (!seen(canvas)) continue;
    const clock = () => figure.querySelector("output").textContent;
    if (button.getAttribute("aria-label") === "Pause") button.click();
    const before = [clock(), ink(canvas)];
    button.click();
    for (let n = 0; n < 100 && (clock() === before[0] || ink(canvas) === before[1]); n++) await passed(20);
    if (clock() === before[0]) faults.push(`does not play: ${before[0]}`);
    if (ink(canvas) === before[1]) faults.push("what is played shows nothing new");
    button.click();
  }
  return faults;
}

/** Everything that an explorer draws and says of the run that it shows. */
function shownBy(explorer) {
  const { player, charts, root } = explorer;
  const walk = Object.values(player.walk.body).concat(player.walk.swing, player.walk.footZ, player.walk.normal, player.walk.friction);
  return {
    run: [...explorer.shown.gap, ...explorer.shown.body, ...explorer.shown.volts].map((row) => row.join()).join(";"),
    film: walk.map((row) => row.join()).join(";"),
    lines: charts.plots.map((plot, i) => charts.put(i) ?? plot.data.slice(1).join(";")).join(";"),
    words: root.querySelector(".explore-measures").textContent,
  };
}

/** What an explorer shows is the run that its engine made: every frame of its picture, and every point of its lines. */
function differences({ shown, player, charts, info }) {
  const faults = [], { walk } = player, at = shown.times.film.length === walk.frames ? [...walk.time].map((t) => shown.time.indexOf(t)) : [];
  if (!at.length || at.includes(-1)) return ["the picture is of other times than the run"];
  const same = (name, drawn, own) => { if (own && !at.every((n, k) => drawn[k] === own[n])) faults.push(`the picture's ${name} is not the run's`); };
  info.legs.forEach((foot, leg) => foot >= 0 && same(`foot ${leg}`, walk.footZ[leg], shown.gap[foot]));
  info.body.forEach((name, k) => player.moment()[name] !== undefined && same(name, walk.body[name], shown.body[k]));
  info.panels.forEach(({ lines }, i) => lines.forEach(([of, k, frozen], n) => {
    if (frozen) return;
    const own = k === null ? shown[of] : shown[of][k], drawn = charts.plots[i].data[n + 1], { step } = charts.spec.panels[i];
    if (drawn.length !== own.length || drawn.some((value, m) => Math.abs(value * step - own[m]) > 1e-12 * Math.abs(own[m]))) faults.push(`line ${n} of panel ${i} is not the run's`);
  }));
  return faults;
}

/** Moves every slider of an explorer: whether what is shown follows it, and what does not. */
async function turn(root) {
  const { explorer } = root, faults = [], followed = [];
  const whole = async () => { while (explorer.busy || !explorer.shown) await passed(5); };
  const moved = async (input, place) => { input.value = place; tell(input, "input"); await passed(1); await whole(); await passed(1); };
  if (!explorer.shown) explorer.turned();
  await whole();
  explorer.charts.plots.forEach((_, i) => { explorer.charts.inSight[i] = true; });
  for (const input of root.querySelectorAll(".explore-slider input")) {
    const name = input.getAttribute("aria-label"), own = input.value, before = shownBy(explorer), label = input.parentNode.querySelector("output").textContent;
    await moved(input, own === input.max ? 0 : Math.min(Number(input.max), Number(own) + Math.max(1, 0.3 * Number(input.max))));
    const after = shownBy(explorer), ran = after.run !== before.run;
    if (input.parentNode.querySelector("output").textContent === label) faults.push(`${name}: its number stays ${label}`);
    if (ran) followed.push(name);
    for (const [part, text] of Object.entries(after)) if (ran && part !== "words" && text === before[part]) faults.push(`${name}: ${part} did not follow`);
    if (explorer.shown.code >= 0) faults.push(...differences(explorer).map((fault) => `${name}: ${fault}`));
    await moved(input, own);
  }
  const said = root.querySelector(".explore-says").textContent;
  if (/^The engine/.test(said)) faults.push(said);
  if (!root.querySelector(".explore-measures td.n")?.textContent) faults.push("no measures");
  return { faults, followed, sliders: explorer.turnable.length };
}

/** Moves every slider of every explorer of the page; those of a page without the engine are none. */
async function turnAll() {
  const found = [];
  for (const root of document.querySelectorAll(".explore")) found.push(await turn(root));
  return found;
}

/** Until nothing that was touched is still at work, and what it changed is drawn. */
async function settled() {
  for (const { explorer } of document.querySelectorAll(".explore")) while (!explorer.start && explorer.busy) await passed(5);
  if (document.querySelector(".explore")) await passed(200); // long lists are made when nothing has moved for a while
  for (let n = 0; n < 2; n++) await new Promise(requestAnimationFrame);
}

Object.assign(window, { interact, play, turnAll, settled, shownBy, differences, ink });
})();
