// What the player draws with: a robot's drawing on its stage.

const AIR = 0, STUCK = 1, SLIPPING = 2;
const ROUND = Array.from({ length: 60 }, (_, i) => Number(`${[1, 2, 5][i % 3]}e${Math.floor(i / 3) - 12}`));
const ROUNDING = 1 + 1e-9;

/** The largest of 1, 2, 5, 10 ... not above a value, and the smallest not below it. */
const roundBelow = (value) => ROUND.filter((step) => step <= value * ROUNDING).pop() || ROUND[0];
const roundAbove = (value) => ROUND.find((step) => step * ROUNDING >= value) || ROUND[ROUND.length - 1];

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
  if (state === STUCK) dot(pen, x, y, size, colors.ink, colors.ink);
  else if (state === SLIPPING) {
    polygon(pen, [[x, y - 1.2 * size], [x + 1.2 * size, y + size], [x - 1.2 * size, y + size]], colors.paper, colors["c-vermilion"]);
  } else dot(pen, x, y, 0.8 * size, colors.paper, colors.muted);
}

/** The robot as its drawing says. `draw` takes a moment of the motion, the choices of the reader and the page's look. */
class RobotDrawing {
  constructor(canvas, walk) {
    this.canvas = canvas;
    this.walk = walk;
    this.size = walk.names.length > 12 ? 3 : 4.5;
    [this.left, this.right, this.low, this.high] = walk.drawing.box;
  }

  draw(moment, choices, look) {
    Object.assign(this, { moment, choices, look, width: look.width });
    const { walk: { drawing, moved } } = this, above = drawing.above ? 84 : 20, below = 58;
    const tall = this.high - this.low, wish = (0.62 * look.width) / Math.max(drawing.length, 0.7 * (this.right - this.left));
    this.height = Math.round(between(tall * wish + above + below, 200, 440));
    this.pen = penFor(this.canvas, this.width, this.height, look.font);
    this.scale = Math.min(wish, (this.height - above - below) / tall);
    const [aside, risen] = moved ? moved.map((way) => moment.read(way)) : [0, 0], { along, up, camera } = choices;
    const middle = camera + 0.5 * (this.left + this.right) - along * aside;
    this.put = ([x, z]) => [0.5 * this.width + (x - middle) * this.scale, this.height - below - (z + up * risen - this.low) * this.scale];
    const at = this.placed(drawing.side).map(this.put);
    this.drawGround(at);
    this.drawParts(drawing.side, at, this.size, choices.forces);
    this.drawScales();
    if (drawing.above) this.drawAbove(drawing.above);
  }

  /** Where the points of a view are now [m]: at rest, and moved by what channels are, enlarged. */
  placed({ points }) {
    const { moment: { channels }, choices: { along, up } } = this;
    const moved = (weights) => weights.reduce((sum, [at, weight]) => sum + weight * channels[at], 0);
    return points.map(([x, z, forward, upward]) => [x + along * moved(forward), z + up * moved(upward)]);
  }

  /** The parts of a view in their order: shapes through points, and feet. */
  drawParts({ parts }, at, size, forces) {
    const { pen, look: { colors } } = this;
    for (const [points, edge, width, fill] of parts) {
      if (edge.length === undefined) this.drawFoot(points, at[edge], size, forces);
      else if (fill) polygon(pen, points.map((n) => at[n]), colors[fill], colors[edge]);
      else line(pen, points.map((n) => at[n]), colors[edge], width);
    }
  }

  drawFoot(leg, [x, y], size, forces) {
    const { pen, walk, moment: { frame }, look: { colors } } = this, { force } = walk.drawing, state = walk.state[leg][frame];
    if (state !== AIR && forces && force > 0) {
      const pixels = (values) => this.arrowLength(between(values[leg][frame], -2 * force, 2 * force));
      arrow(pen, x, y, 0, -pixels(walk.normal), colors.good);
      arrow(pen, x, y, pixels(walk.friction), 0, colors.calm);
    }
    if (state === STUCK) line(pen, [[x - 1.8 * size, y + 1], [x + 1.8 * size, y + 1]], colors.ink, 2);
    mark(pen, state, x, y, size, colors);
  }

  drawGround(feet) {
    const { pen, width, walk: { drawing, body, ground }, look: { colors, ink }, choices: { along, up } } = this;
    const [start, level] = this.put([0, 0]), back = drawing.back * this.scale, half = 0.5 * drawing.wide * this.scale;
    pen.fillStyle = colors.soft;
    if (drawing.level) pen.fillRect(0, level - back, width, back + 3);
    for (const [number, point, x, z, shift, paint] of drawing.pieces) {
      const place = ([at, height]) => this.put([x + along * (at - shift), z + up * height]);
      pen.save();
      pen.beginPath();
      pen.rect(feet[point][0] - half, 0, 2 * half, this.height);
      pen.clip();
      line(pen, ground[number].map(place), colors[paint]);
      pen.restore();
    }
    if (drawing.level && !drawing.pieces.length) line(pen, [[0, level], [width, level]], colors.muted);
    if (!body.surge) {
      for (const [leg, point] of drawing.side.parts) if (point.length === undefined) words(pen, this.walk.names[leg], feet[point][0], this.height - 31, colors.muted, "center");
      return;
    }
    const pixels = along * this.scale, step = roundAbove(84 / pixels);
    for (let k = Math.ceil(-start / (step * pixels)); start + k * step * pixels <= width; k++) {
      const x = start + k * step * pixels;
      line(pen, [[x, level], [x, level + 5]], colors.muted);
      if (x > 30 && x < width - 30) words(pen, amount(k * step, "m"), x, level + 27, colors.muted, "center");
    }
    const x = start + this.moment.surge * pixels;
    polygon(pen, [[x, level + 4], [x - 5, level + 13], [x + 5, level + 13]], ink);
  }

  /** Length of a force's arrow [pixels]. */
  arrowLength(force) {
    const { drawing } = this.walk;
    return (0.45 * drawing.leg * this.scale * force) / drawing.force;
  }

  /** What a length and an arrow of the picture stand for. */
  drawScales() {
    const { pen, look: { colors, ink }, walk: { drawing, incline: tilt }, choices } = this, y = this.height - 8;
    const apart = this.width < 420 ? 10 : 26; // three scales on a phone
    let x = 4;
    const say = (text, from) => {
      words(pen, text, from, y, colors.muted);
      x = from + pen.measureText(text).width + apart;
    };
    if (drawing.true) {
      const real = roundBelow((0.14 * this.width) / this.scale), long = real * this.scale;
      line(pen, [[x, y - 8], [x, y], [x + long, y], [x + long, y - 8]], colors.muted);
      say(`${amount(real, "m")} of the robot`, x + long + 6);
    }
    const pixels = choices.up * this.scale, rise = roundBelow(24 / pixels), tall = rise * pixels;
    line(pen, [[x, y], [x + 6, y], [x + 6, y - tall], [x, y - tall]], colors.muted);
    say(`${amount(rise, "m")} upward`, x + 12);
    if (drawing.force > 0 && choices.forces) {
      const force = roundBelow(drawing.force), long = this.arrowLength(force);
      arrow(pen, x, y - 4, long, 0, colors.good);
      say(amount(force, "N"), x + long + 6);
    }
    if (!tilt) return;
    const pull = 18, [dx, dy] = [-pull * Math.sin(tilt), pull * Math.cos(tilt)];
    arrow(pen, x + pull - dx / 2, y - 9 - dy / 2, dx, dy, ink);
    say("gravity", x + 2 * pull + 4);
  }

  /** The view from above in a corner. */
  drawAbove(view) {
    const { pen, look: { colors } } = this, room = Math.min(180, 0.3 * this.width), tall = 46;
    const ends = (of) => [Math.min(...view.points.map(of)), Math.max(...view.points.map(of))];
    const [[back, front], [right, left]] = [ends(([x]) => x), ends(([, y]) => y)];
    const scale = Math.min((room - 24) / (front - back), tall / (left - right));
    const [x0, y0] = [this.width - room / 2 - 4 - 0.5 * (back + front) * scale, 24 + tall / 2 + 0.5 * (left + right) * scale];
    words(pen, "from above", this.width - 6, 12, colors.muted, "right");
    this.drawParts(view, this.placed(view).map(([x, y]) => [x0 + x * scale, y0 - y * scale]), 0.8 * this.size, false);
  }
}
