// What the player of a walk draws with: the robot on its stage, and series over time as tracks.

const AIR = 0, STUCK = 1, SLIPPING = 2;
const ROUND = Array.from({ length: 60 }, (_, i) => Number(`${[1, 2, 5][i % 3]}e${Math.floor(i / 3) - 12}`));
const ROUNDING = 1 + 1e-9;

/** The largest of 1, 2, 5, 10 ... not above a value, and the smallest not below it. */
const roundBelow = (value) => ROUND.filter((step) => step <= value * ROUNDING).pop() || ROUND[0];
const roundAbove = (value) => ROUND.find((step) => step * ROUNDING >= value) || ROUND[ROUND.length - 1];

const between = (value, least, most) => Math.min(Math.max(value, least), most);

/** A pen for a canvas of a width and height [CSS pixels], sharp on any screen. */
function penFor(canvas, width, height, font) {
  const sharp = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * sharp) || canvas.height !== Math.round(height * sharp)) {
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * sharp);
    canvas.height = Math.round(height * sharp);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(sharp, 0, 0, sharp, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = `12px ${font}`;
  return pen;
}

function trace(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
}

function line(pen, points, color, width = 1) {
  trace(pen, points);
  pen.strokeStyle = color;
  pen.lineWidth = width;
  pen.stroke();
}

function polygon(pen, points, fill, edge) {
  trace(pen, points);
  pen.closePath();
  pen.fillStyle = fill;
  pen.fill();
  if (!edge) return;
  pen.strokeStyle = edge;
  pen.lineWidth = 1.25;
  pen.stroke();
}

function dot(pen, x, y, radius, fill, edge) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fillStyle = fill;
  pen.fill();
  pen.strokeStyle = edge;
  pen.lineWidth = 1.25;
  pen.stroke();
}

function words(pen, text, x, y, color, align = "left", most = undefined) {
  pen.fillStyle = color;
  pen.textAlign = align;
  pen.fillText(text, x, y, most);
}

/** Points of a spring from one end to the other, so wide. */
function spring([x0, y0], [x1, y1], wide) {
  const turns = 6, at = (share, side) => [x0 + share * (x1 - x0) + side * wide, y0 + share * (y1 - y0)];
  const zigzag = Array.from({ length: 2 * turns }, (_, k) => at(0.15 + (0.7 * (k + 0.5)) / (2 * turns), k % 2 ? 1 : -1));
  return [[x0, y0], at(0.15, 0), ...zigzag, at(0.85, 0), [x1, y1]];
}

/** An arrow from (x, y) by (dx, dy); nothing where it is shorter than a pixel. */
function arrow(pen, x, y, dx, dy, color) {
  const length = Math.hypot(dx, dy);
  if (length < 1) return;
  const head = Math.min(6, 0.6 * length), ux = dx / length, uy = dy / length;
  const tip = [x + dx, y + dy], neck = [tip[0] - ux * head, tip[1] - uy * head];
  line(pen, [[x, y], neck], color, 2);
  polygon(pen, [tip, [neck[0] - 0.5 * uy * head, neck[1] + 0.5 * ux * head],
    [neck[0] + 0.5 * uy * head, neck[1] - 0.5 * ux * head]], color);
}

/** A foot: full where it is stuck, an open triangle where it slips, an open circle in the air. */
function mark(pen, state, x, y, size, colors) {
  if (state === STUCK) dot(pen, x, y, size, colors.stuck, colors.stuck);
  else if (state === SLIPPING) {
    polygon(pen, [[x, y - 1.2 * size], [x + 1.2 * size, y + size], [x - 1.2 * size, y + size]], colors.paper, colors.slip);
  } else dot(pen, x, y, 0.8 * size, colors.paper, colors.muted);
}

/** The robot from its right side. `draw` takes a moment of the walk, the choices of the reader and the page's look. */
class Stage {
  constructor(canvas, walk) {
    this.canvas = canvas;
    this.walk = walk;
    const y = walk.stage.y;
    this.right = Math.min(...y);
    this.wide = Math.max(...y) - this.right;
    this.order = y.map((_, leg) => leg).sort((a, b) => y[b] - y[a]);
    this.size = walk.names.length > 12 ? 3 : 4.5;
    const { leg, thick, length, back, up } = walk.stage;
    this.lowest = walk.moved ? Math.min(...walk.moved[1]) : 0;
    const highest = walk.moved ? Math.max(...walk.moved[1]) - this.lowest : 0;
    this.tall = leg + thick + (this.wide > 0 ? back[1] * length : 0) + up * (Math.max(0, ...walk.body.heave) + highest);
  }

  far(leg) {
    const { stage } = this.walk;
    return stage.y[leg] > this.right + 0.5 * this.wide + 1e-9 * stage.length;
  }

  /** How far back a place at y is: 0 on the near side, 1 on the far one. */
  depth(y) {
    return this.wide > 0 ? (y - this.right) / this.wide : 0;
  }

  draw(moment, choices, look) {
    this.moment = moment;
    this.choices = choices;
    this.look = look;
    const { stage } = this.walk;
    const above = this.wide > 0 ? 84 : 20, below = 58, wish = (0.62 * look.width) / stage.length;
    this.height = Math.round(between(this.tall * wish + above + below, 200, 440));
    this.width = look.width;
    this.pen = penFor(this.canvas, this.width, this.height, look.font);
    this.scale = Math.min(wish, (this.height - above - below) / this.tall);
    [this.aside, this.risen] = this.walk.moved ? this.walk.moved.map((way) => moment.read(way)) : [0, this.lowest];
    this.ground = this.height - below - choices.up * (this.risen - this.lowest) * this.scale;
    this.drawGround();
    this.order.filter((leg) => this.far(leg)).forEach((leg) => this.drawLeg(leg));
    this.drawBody();
    this.order.filter((leg) => !this.far(leg)).forEach((leg) => this.drawLeg(leg));
    this.drawScales();
    if (this.wide > 0) this.drawAbove();
  }

  /** Where a drawn place (x, y, z) [m] falls on the canvas. */
  place(x, y, z) {
    const { walk: { stage } } = this, [forward, upward] = stage.back;
    const deep = this.depth(y), middle = 0.5 * (stage.box[0] + stage.box[1]);
    const view = x + this.choices.along * this.aside - middle - this.choices.camera + (deep - 0.5 * (this.wide > 0)) * forward * stage.length;
    return [0.5 * this.width + view * this.scale, this.ground - (z + deep * upward * stage.length) * this.scale];
  }

  drawGround() {
    const { pen, width, ground, look: { colors } } = this, { stage } = this.walk;
    const back = this.wide > 0 ? stage.back[1] * stage.length * this.scale : 0;
    pen.fillStyle = colors.ground;
    pen.fillRect(0, ground - back, width, back + 3);
    if (this.walk.ground.length) this.walk.names.forEach((_, leg) => this.drawFacets(leg));
    else line(pen, [[0, ground], [width, ground]], colors.muted);
    if (stage.springs) return;
    const pixels = this.choices.along * this.scale, step = roundAbove(84 / pixels);
    const start = this.place(0, this.right, 0)[0];
    for (let k = Math.ceil(-start / (step * pixels)); start + k * step * pixels <= width; k++) {
      const x = start + k * step * pixels;
      line(pen, [[x, ground], [x, ground + 5]], colors.muted);
      if (x > 30 && x < width - 30) words(pen, amount(k * step, "m"), x, ground + 27, colors.muted, "center");
    }
    const [x, y] = this.place(this.choices.along * this.moment.surge, this.right, 0);
    polygon(pen, [[x, y + 4], [x - 5, y + 13], [x + 5, y + 13]], this.look.ink);
  }

  /** The piece of uneven ground that a foot stands on, as large as its motion is drawn; in its leg's colour where feet go along several lines. */
  drawFacets(leg) {
    const { walk, moment, choices: { up, along } } = this, { stage } = walk, x = moment.read(walk.footX[leg]);
    const half = (0.5 * stage.piece) / along, [hipX] = walk.hips[leg], ground = walk.ground[walk.line[leg]];
    const height = (place) => {
      const after = ground.findIndex(([at]) => at > place), [x1, z1] = ground.at(after), [x0, z0] = ground.at(after - 1);
      return after < 1 ? z1 : z0 + ((place - x0) / (x1 - x0)) * (z1 - z0);
    };
    const { colors } = this.look, color = walk.ground.length === 1 ? colors.muted : this.far(leg) ? colors["far-leg"] : colors.leg;
    const inside = ground.filter(([place]) => Math.abs(place - x) < half);
    const piece = [[x - half, height(x - half)], ...inside, [x + half, height(x + half)]];
    line(this.pen, piece.map(([place, z]) => this.place(stage.x[leg] + along * (place - hipX), stage.y[leg], up * z)), color);
  }

  drawBody() {
    const { pen, look: { colors, ink } } = this, { stage } = this.walk;
    const { surge, heave, roll, pitch } = this.moment, { up, along } = this.choices;
    const face = (y) => [[0, 0], [1, 0], [1, 1], [0, 1]].map(([end, top]) => {
      const x = stage.box[end];
      return this.place(x + along * surge, y, stage.leg + top * stage.thick + up * (heave + y * roll - x * pitch));
    });
    const far = face(stage.box[3]), near = face(stage.box[2]);
    polygon(pen, far, colors.far, colors.muted);
    polygon(pen, [near[3], near[2], far[2], far[3]], colors.far, colors.muted);
    polygon(pen, [near[1], near[2], far[2], far[1]], colors.far, colors.muted);
    polygon(pen, near, colors.near, ink);
  }

  drawLeg(leg) {
    const { pen, size, walk, moment, look: { colors } } = this, { stage } = walk, { up, along } = this.choices;
    const [hipX, hipY, hipZ] = walk.hips[leg], color = this.far(leg) ? colors["far-leg"] : colors.leg;
    const hip = this.place(stage.x[leg] + along * (moment.surge + hipZ * moment.pitch - hipY * moment.yaw), stage.y[leg],
      stage.z[leg] + up * (moment.heave + hipY * moment.roll - hipX * moment.pitch));
    const [x, y] = this.place(stage.x[leg] + along * (moment.read(walk.footX[leg]) - hipX), stage.y[leg],
      up * moment.read(walk.footZ[leg]));
    line(pen, stage.springs ? spring(hip, [x, y], size) : [hip, [x, y]], color, size / 2);
    dot(pen, hip[0], hip[1], 2, color, color);
    const state = walk.state[leg][moment.frame];
    if (state !== AIR && this.choices.forces && stage.force > 0) {
      const pixels = (force) => this.arrowLength(between(force, -2 * stage.force, 2 * stage.force));
      arrow(pen, x, y, 0, -pixels(walk.normal[leg][moment.frame]), colors.push);
      arrow(pen, x, y, pixels(walk.friction[leg][moment.frame]), 0, colors.friction);
    }
    if (state === STUCK) line(pen, [[x - 1.8 * size, y + 1], [x + 1.8 * size, y + 1]], colors.stuck, 2);
    mark(pen, state, x, y, size, colors);
  }

  /** Length of a force's arrow [pixels]. */
  arrowLength(force) {
    const { stage } = this.walk;
    return (0.45 * stage.leg * this.scale * force) / stage.force;
  }

  /** What a length and an arrow of the picture stand for. */
  drawScales() {
    const { pen, look: { colors } } = this, { stage } = this.walk, y = this.height - 8;
    let x = 4;
    const say = (text, from) => {
      words(pen, text, from, y, colors.muted);
      x = from + pen.measureText(text).width + 26;
    };
    if (stage.true) {
      const real = roundBelow((0.14 * this.width) / this.scale), long = real * this.scale;
      line(pen, [[x, y - 8], [x, y], [x + long, y], [x + long, y - 8]], colors.muted);
      say(`${amount(real, "m")} of the robot`, x + long + 6);
    }
    const pixels = this.choices.up * this.scale, rise = roundBelow(24 / pixels), tall = rise * pixels;
    line(pen, [[x, y], [x + 6, y], [x + 6, y - tall], [x, y - tall]], colors.muted);
    say(`${amount(rise, "m")} upward`, x + 12);
    if (stage.force > 0 && this.choices.forces) {
      const force = roundBelow(stage.force), long = this.arrowLength(force);
      arrow(pen, x, y - 4, long, 0, colors.push);
      say(amount(force, "N"), x + long + 6);
    }
    const tilt = this.walk.incline, pull = 18;
    if (tilt) {
      const [dx, dy] = [-pull * Math.sin(tilt), pull * Math.cos(tilt)];
      arrow(pen, x + pull - dx / 2, y - 9 - dy / 2, dx, dy, this.look.ink);
      say("gravity", x + 2 * pull + 4);
    }
  }

  /** The feet from above, forward to the right, left side up. */
  drawAbove() {
    const { pen, walk, moment, look: { colors } } = this, { stage } = walk;
    const [back, front, right, left] = stage.box, room = Math.min(180, 0.3 * this.width), tall = 46;
    const scale = Math.min((room - 24) / (front - back), tall / this.wide);
    const [x0, y0] = [this.width - room / 2 - 4 - 0.5 * (back + front) * scale, 24 + tall / 2 + 0.5 * (left + right) * scale];
    const put = (x, y) => [x0 + x * scale, y0 - y * scale];
    const inside = (y) => 0.5 * (left + right) + 0.62 * (y - 0.5 * (left + right));
    words(pen, "from above", this.width - 6, 12, colors.muted, "right");
    const corners = [[back, right], [front, right], [front, left], [back, left]];
    polygon(pen, corners.map(([x, y]) => put(x, inside(y))), colors.far, colors.muted);
    walk.names.forEach((_, leg) => {
      const swing = this.choices.along * (moment.read(walk.footX[leg]) - walk.hips[leg][0] - moment.surge);
      const [x, y] = put(stage.x[leg] + swing, stage.y[leg]);
      line(pen, [put(stage.x[leg], inside(stage.y[leg])), [x, y]], colors["far-leg"]);
      mark(pen, walk.state[leg][moment.frame], x, y, 0.8 * this.size, colors);
    });
  }
}

/** Series over time below each other, with a line at the time shown. */
class Tracks {
  constructor(canvas, walk) {
    this.canvas = canvas;
    this.walk = walk;
    this.left = 86;
    this.right = 22;
  }

  /** The time [s] under a place on the page. */
  timeAt(clientX) {
    const { walk: { start, end } } = this, box = this.canvas.getBoundingClientRect();
    const share = (clientX - box.left - this.left) / (box.width - this.left - this.right);
    return start + between(share, 0, 1) * (end - start);
  }

  x(time) {
    const { walk: { start, end } } = this;
    return this.left + ((this.width - this.left - this.right) * (time - start)) / (end - start);
  }

  /** Draw the cursor over the series, which are drawn only once for a size and a look of the page. */
  draw(now, look) {
    if (!look.tracks) return; // a page may leave them out
    const { walk } = this, row = walk.names.length > 16 ? 10 : 15, curve = 58;
    const height = walk.volts.length * 22 + walk.names.length * row + 2 * (curve + 16) + 44;
    this.width = look.tracks;
    const pen = penFor(this.canvas, this.width, height, look.font);
    if (!this.kept || this.kept.width !== this.canvas.width || this.look !== look) {
      this.look = look;
      this.kept = document.createElement("canvas");
      this.kept.width = this.canvas.width;
      this.kept.height = this.canvas.height;
      const ink = this.kept.getContext("2d");
      ink.setTransform(pen.getTransform());
      ink.font = pen.font;
      ink.textBaseline = "middle";
      this.drawAll(ink, row, curve);
    }
    pen.save();
    pen.resetTransform();
    pen.drawImage(this.kept, 0, 0);
    pen.restore();
    line(pen, [[this.x(now), 0], [this.x(now), height - 20]], look.colors.slip, 1.5);
  }

  drawAll(pen, row, curve) {
    const { walk } = this;
    let y = 4;
    walk.volts.forEach((values, i) => {
      this.drawCurve(pen, values, y, 15, walk.drives[i]);
      y += 22;
    });
    this.drawGait(pen, y + 6, row);
    y += walk.names.length * row + 22;
    for (const [word, name] of [["travel", "surge"], ["height", "heave"]]) {
      this.drawCurve(pen, walk.body[name], y, curve, word, "m");
      y += curve + 16;
    }
    this.drawTimes(pen, y - 12);
  }

  drawCurve(pen, values, top, tall, word, unit) {
    const { walk, look: { colors, ink }, left } = this;
    const least = Math.min(...values), most = Math.max(...values), span = most - least || 1;
    words(pen, word, left - 8, top + tall / 2, ink, "right", left - 10);
    if (unit) {
      words(pen, amount(most, unit), left - 8, top + 4, colors.muted, "right");
      words(pen, amount(least, unit), left - 8, top + tall - 4, colors.muted, "right");
    }
    line(pen, [[left, top + tall + 2], [this.x(walk.end), top + tall + 2]], colors.rule);
    line(pen, Array.from(values, (v, i) => [this.x(walk.time[i]), top + (tall * (most - v)) / span]), colors.leg, 1.25);
  }

  /** Contact of every foot over time: full bars stuck, half bars slipping. */
  drawGait(pen, top, row) {
    const { walk, look: { colors, ink, font }, left } = this;
    pen.font = `${Math.min(12, row)}px ${font}`;
    walk.names.forEach((name, leg) => {
      const states = walk.state[leg], y = top + leg * row;
      words(pen, name, left - 8, y + row / 2, ink, "right", left - 10);
      line(pen, [[left, y + row - 0.5], [this.x(walk.end), y + row - 0.5]], colors.rule, 0.5);
      for (let i = 0, j; i < walk.frames; i = j) {
        for (j = i + 1; j < walk.frames && states[j] === states[i]; ) j++;
        if (states[i] === AIR) continue;
        const from = this.x(walk.time[i]), to = this.x(walk.time[Math.min(j, walk.frames - 1)]);
        const tall = states[i] === STUCK ? row - 3 : (row - 3) / 2;
        pen.fillStyle = states[i] === STUCK ? colors.stuck : colors.slip;
        pen.fillRect(from, y + (row - 1 - tall) / 2, Math.max(to - from, 0.75), tall);
      }
    });
    pen.font = `12px ${font}`;
  }

  drawTimes(pen, top) {
    const { walk: { start, end }, look: { colors } } = this;
    const step = roundAbove(((end - start) * 90) / (this.width - this.left - this.right));
    for (let k = Math.ceil(start / step - 1e-6); k * step <= end * ROUNDING; k++) {
      const x = this.x(k * step);
      line(pen, [[x, top], [x, top + 4]], colors.muted);
      words(pen, amount(k * step, "s", 4), x, top + 14, colors.muted, "center");
    }
  }
}
