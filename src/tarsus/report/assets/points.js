// Plays the points of a robot from the data beside it; asks nothing of any network.
(() => {
"use strict";
const root = document.currentScript.closest("figure"), data = JSON.parse(root.querySelector(".points-data").textContent);
const canvas = root.querySelector("canvas"), button = root.querySelector("button");
const slider = root.querySelector("input"), clock = root.querySelector("output");
const bytes = (text) => Uint8Array.from(atob(text), (character) => character.charCodeAt(0)).buffer;
const time = new Float32Array(bytes(data.time.data));
const y = data.y.map((row) => Float64Array.from(new Uint16Array(bytes(row.data)), (q) => (row.low + q) * row.step));
const levels = data.feet.map((foot) => foot.level);
const low = Math.min(0, ...levels, ...y.map((row) => Math.min(...row))), high = Math.max(0, ...y.map((row) => Math.max(...row)));
const PLAYED = 12; // seconds that the whole takes
let frame = 0, playing = false;
slider.max = time.length - 1;

function draw() {
  const sharp = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width) return;
  canvas.width = Math.round(width * sharp);
  canvas.height = Math.round(height * sharp);
  const pen = canvas.getContext("2d"), style = getComputedStyle(root);
  const color = (name) => style.getPropertyValue(`--${name}`).trim();
  pen.setTransform(sharp, 0, 0, sharp, 0, 0);
  pen.font = `12px ${style.fontFamily}`;
  const x = (share) => 24 + share * (width - 72), up = (value) => height - 28 - ((value - low) / (high - low || 1)) * (height - 48);
  const now = time[frame], at = data.across.map(x), heights = y.map((row) => row[frame]);
  pen.strokeStyle = color("rule");
  pen.beginPath();
  pen.moveTo(x(0), up(0));
  pen.lineTo(x(1), up(0));
  pen.stroke();
  pen.lineWidth = 2.5;
  pen.strokeStyle = color("c-blue");
  if (data.beam) bend(pen, x, up, heights);
  else at.forEach((place, i) => stem(pen, place, up(0), up(heights[i])));
  data.feet.forEach((foot) => {
    const held = foot.held.some(([start, end]) => now >= start && now <= end);
    pen.fillStyle = color(held ? "ink" : "contact");
    pen.fillRect(at[foot.point] - 22, up(foot.level) + 4, 44, 7);
  });
  heights.forEach((value, i) => {
    pen.fillStyle = color("c-vermilion");
    pen.beginPath();
    pen.arc(at[i], up(value), 4, 0, 2 * Math.PI);
    pen.fill();
    pen.fillStyle = color("muted");
    pen.textAlign = "center";
    pen.fillText(data.names[i], at[i], height - 4);
  });
  clock.textContent = `${(now / data.step).toFixed(2)} ${data.clock}`;
  slider.value = frame;
  slider.setAttribute("aria-valuetext", clock.textContent);
}

/** A line from the clamp, level there, through both points: a x² + b x³. */
function bend(pen, x, up, heights) {
  const [[p, u], [q, v]] = data.across.map((share, i) => [share, heights[i]]);
  const b = (v / q ** 2 - u / p ** 2) / (q - p), a = u / p ** 2 - b * p;
  pen.beginPath();
  for (let i = 0; i <= 60; i++) pen.lineTo(x(i / 60), up(a * (i / 60) ** 2 + b * (i / 60) ** 3));
  pen.stroke();
}

function stem(pen, place, from, to) {
  pen.beginPath();
  pen.moveTo(place, from);
  pen.lineTo(place, to);
  pen.stroke();
}

function play() {
  playing = !playing;
  button.textContent = playing ? "Pause" : "Play";
  if (frame >= time.length - 1) frame = 0;
  let before = null, exact = frame;
  const turn = (stamp) => {
    if (!playing) return;
    if (before !== null) exact += ((stamp - before) / 1000 / PLAYED) * time.length;
    before = stamp;
    frame = Math.min(Math.floor(exact), time.length - 1);
    draw();
    if (frame >= time.length - 1) play();
    else requestAnimationFrame(turn);
  };
  if (playing) requestAnimationFrame(turn);
}

button.addEventListener("click", play);
slider.addEventListener("input", () => {
  if (playing) play();
  frame = Number(slider.value);
  draw();
});
addEventListener("themechange", draw);
new ResizeObserver(draw).observe(canvas);
})();
