// Plays the motion of a robot: reads the data next to it and moves its time; asks nothing of any network.

/** Series of a packed channel, an array a row: value = (low + q) step; so many rows of zeros where there is none. */
function unpack(channel, frames, rows) {
  if (!channel) return Array.from({ length: rows }, () => new Float64Array(frames));
  const raw = Uint8Array.from(atob(channel.data), (character) => character.charCodeAt(0)), whole = channel.bits === 16 ? new Uint16Array(raw.buffer) : raw;
  const values = Float64Array.from(whole, (q) => (channel.low + q) * channel.step);
  return Array.from({ length: values.length / frames }, (_, row) => values.subarray(row * frames, (row + 1) * frames));
}

/** The motion as arrays over its frames: coordinates of the body, and of every leg its foot and what acts there. */
function readWalk(data) {
  const { frames, legs } = data, time = unpack(data.time, frames)[0], rows = (name) => unpack(data[name], frames, legs.length);
  return {
    frames, time, start: time[0], end: time[frames - 1], period: data.period, incline: data.incline, drawing: data.drawing,
    body: Object.fromEntries(Object.entries(data.body).map(([name, channel]) => [name, unpack(channel, frames)[0]])),
    ground: data.ground, moved: data.moved ? unpack(data.moved, frames) : null, names: legs, channels: data.channels,
    swing: rows("swing"), footZ: rows("foot_z"), normal: rows("normal"), friction: rows("friction"),
    state: rows("state"),
  };
}

/** Mean of a series over a drive period about each frame, a twentieth of the walk if none repeats. */
function smoothed(walk, values) {
  const { frames } = walk, span = walk.end - walk.start;
  const half = Math.max(1, Math.round((0.5 * frames * Math.min(walk.period || 0.05 * span, span)) / span));
  const sums = new Float64Array(frames + 1);
  values.forEach((value, i) => (sums[i + 1] = sums[i] + value));
  return values.map((_, i) => {
    const reach = Math.min(half, i, frames - 1 - i);
    return (sums[i + reach + 1] - sums[i - reach]) / (2 * reach + 1);
  });
}

/** Way of the body's centre, with the ground where that moves, without its swing in a drive period. */
function pathOf(walk) {
  const { body: { surge = new Float64Array(walk.frames) }, moved } = walk;
  return smoothed(walk, moved ? surge.map((way, i) => way + moved[0][i]) : surge);
}

class Player {
  constructor(root) {
    const part = (name) => root.querySelector(`.walk-${name}`);
    this.root = root;
    this.walk = readWalk(JSON.parse(part("data").textContent));
    this.path = pathOf(this.walk);
    this.now = this.walk.start;
    this.playing = false;
    this.again = false; // whether it begins again at its end
    for (const name of ["play", "icon", "back", "next", "time", "clock", "speed", "up", "along", "forces", "follow",
      "says"]) this[name] = part(name);
    this.stage = new RobotDrawing(part("stage"), this.walk);
    this.fillChoices();
    this.listen();
    root.classList.add("live");
    root.player = this;
    part("live").hidden = false;
    this.restyle();
  }

  /** Other series of the same robot take the place of these, at the time since their start that is shown. */
  take(series) {
    const walk = { ...this.walk, ...series };
    this.now = between(walk.start + this.now - this.walk.start, walk.start, walk.end);
    this.walk = this.stage.walk = walk;
    this.path = pathOf(walk);
    this.time.max = walk.frames - 1;
    this.draw();
  }

  fillChoices() {
    const { period, start, end, drawing, frames } = this.walk;
    const usual = roundBelow(period ? period / 2 : (end - start) / 20);
    for (const speed of ROUND.filter((s) => s >= 0.019 * usual && s <= Math.max(end - start, usual) * ROUNDING)) {
      const slower = speed < 0.99 ? ` (${Math.round(1 / speed)}× slower)` : "";
      this.speed.add(new Option(`${amount(speed, "s")} a second${slower}`, speed, speed === usual, speed === usual));
    }
    for (const [select, usual] of [[this.up, drawing.up], [this.along, drawing.along]]) {
      for (const factor of ROUND.filter((f) => f >= 1 && f >= 0.019 * usual && f <= 51 * usual)) {
        const chosen = Math.abs(factor / usual - 1) < 1e-6;
        select.add(new Option(`×${factor}`, factor, chosen, chosen));
      }
    }
    this.time.max = frames - 1;
  }

  listen() {
    this.play.addEventListener("click", () => this.toggle());
    this.back.addEventListener("click", () => this.step(-1));
    this.next.addEventListener("click", () => this.step(1));
    this.time.addEventListener("input", () => this.go(this.walk.time[Number(this.time.value)]));
    this.time.addEventListener("keydown", (event) => {
      if (event.key !== " ") return;
      event.preventDefault();
      this.toggle();
    });
    for (const choice of [this.up, this.along, this.forces, this.follow]) {
      choice.addEventListener("change", () => this.draw());
    }
    addEventListener("seek", ({ detail }) => this.go(between(detail, this.walk.start, this.walk.end))); // a click on a figure over time
    addEventListener("themechange", () => this.restyle());
    new ResizeObserver(() => this.restyle()).observe(this.stage.canvas);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.run();
  }

  run() {
    if (this.now >= this.walk.end) this.now = this.walk.start;
    this.playing = true;
    this.label();
    let before = null;
    const turn = (stamp) => {
      if (!this.playing) return;
      if (before !== null) this.now += ((stamp - before) / 1000) * Number(this.speed.value);
      before = stamp;
      const over = this.now - this.walk.end;
      this.now = over >= 0 && this.again ? this.walk.start : Math.min(this.now, this.walk.end);
      this.draw();
      if (over >= 0 && !this.again) this.pause();
      else requestAnimationFrame(turn);
    };
    requestAnimationFrame(turn);
  }

  pause() {
    this.playing = false;
    this.label();
  }

  label() {
    this.play.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    this.icon.setAttribute("d", this.playing ? "M3 2h3.5v12h-3.5zM9.5 2h3.5v12h-3.5z" : "M3 1.5v13l11-6.5z");
  }

  step(frames) {
    this.go(this.walk.time[between(this.moment().frame + frames, 0, this.walk.frames - 1)]);
  }

  /** Show a time and stay there. */
  go(time) {
    this.pause();
    this.now = time;
    this.draw();
  }

  /** Now: the last frame not after it, a reader of series (straight between frames), and what the drawing's channels are. */
  moment() {
    const { time, start, end, frames, body, channels, swing, footZ } = this.walk, now = this.now + 1e-9 * (end - start);
    let low = 0, high = frames - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (time[middle] <= now) low = middle;
      else high = middle - 1;
    }
    const next = Math.min(low + 1, frames - 1);
    const share = next > low ? between((this.now - time[low]) / (time[next] - time[low]), 0, 1) : 0;
    const read = (series) => series[low] + share * (series[next] - series[low]);
    const [one, ...moves] = channels, own = Object.fromEntries(moves.map((name) => [name, body[name] ? read(body[name]) : 0]));
    return { frame: low, read, ...own, channels: [1, ...Object.values(own), ...swing.map(read), ...footZ.map(read)] };
  }

  /** Read the page's colours, font and widths again, and draw: to ask for them at every frame lays out the page anew. */
  restyle() {
    const style = getComputedStyle(this.root), colors = {};
    const color = (name) => style.getPropertyValue(name).trim();
    for (const name of ["paper", "soft", "body-near", "body-far", "c-blue", "leg-far", "c-vermilion", "good", "calm", "muted",
      "ink", "rule"]) colors[name] = color(`--${name}`);
    this.look = { font: style.fontFamily, ink: style.color, colors, width: this.stage.canvas.clientWidth };
    this.draw();
  }

  draw() {
    if (!this.look.width) return;
    const moment = this.moment(), along = Number(this.along.value);
    const camera = along * (this.follow.checked ? moment.read(this.path) : 0.5 * (this.path[0] + this.path[this.walk.frames - 1]));
    this.time.value = moment.frame;
    this.clock.textContent = amount(this.now, "s", 4);
    this.time.setAttribute("aria-valuetext", this.clock.textContent);
    this.stage.draw(moment, { up: Number(this.up.value), along, camera, forces: this.forces.checked }, this.look);
    this.say(moment);
    dispatchEvent(new CustomEvent("walktime", { detail: this.now })); // figures over time mark it
  }

  /** What is seen, in words. */
  say({ frame, surge, heave, yaw }) {
    const feet = [[STUCK, "stuck"], [SLIPPING, "slipping"]].map(([state, word]) => {
      const names = this.walk.names.filter((_, leg) => this.walk.state[leg][frame] === state);
      return names.length ? `, ${names.length > 6 ? `${names.length} feet` : names.join(" ")} ${word}` : "";
    }).join("");
    const heading = this.walk.body.yaw ? `, heading ${amount(yaw, "rad")}` : "";
    const where = !this.walk.body.surge ? "Feet" : `Travel ${amount(surge, "m")}, height ${amount(heave, "m")}${heading}`;
    this.says.textContent = `${where}${feet || ", no foot on the ground"}.`.replace("Feet, no", "No").replace("Feet,", "Feet:");
  }
}

document.querySelectorAll(".walk:not(.live)").forEach((root) => new Player(root));
