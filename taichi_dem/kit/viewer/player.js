"use strict";
// Shared by all pages: packed data, colours and their legend, the player, curves over time.

const KINDS = {
  uint8: Uint8Array, int16: Int16Array, uint16: Uint16Array, uint32: Uint32Array,
  float32: Float32Array,
};
const byId = (id) => document.getElementById(id);
const view = JSON.parse(byId("data").textContent);
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Array of what the Python function pack made; all machines with browsers are little-endian. */
function unpack(packed) {
  const bytes = Uint8Array.from(atob(packed.data), (letter) => letter.charCodeAt(0));
  return new KINDS[packed.kind](bytes.buffer);
}

/** Function of a frame's number that gives its values; packed by the Python function quantise. */
function unpackFrames(packed) {
  const whole = unpack(packed), width = whole.length / packed.scale.length;
  return (frame) => Float32Array.from(
    whole.subarray(frame * width, (frame + 1) * width), (value) => value * packed.scale[frame]);
}

/** An element with attributes and children. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** A number in at most three figures. */
function inFigures(value) {
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return value.toExponential(1).replace(".0e", "e");
  return String(Number(value.toPrecision(3)));
}

/** Round numbers from low to high, about as many as wanted. */
function roundTicks(low, high, wanted) {
  const rough = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= 0.999 * rough);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-6); k * step <= high + 1e-6 * step; k++) ticks.push(k * step);
  return ticks;
}

/** Powers of ten from low to high. */
function powersOfTen(low, high) {
  const ticks = [];
  for (let k = Math.ceil(Math.log10(low) - 1e-6); 10 ** k <= 1.001 * high; k++) ticks.push(10 ** k);
  return ticks;
}

/** Colours of values: mode has label, low, high, table of 256 colours, and log, names or keys. */
class ColourScale {
  constructor(mode) {
    this.mode = mode;
    this.table = unpack(mode.table);
    this.by = mode.log ? (value) => Math.log(Math.max(value, 1e-300)) : (value) => value;
    this.start = this.by(mode.low);
    this.length = this.by(mode.high) - this.start || 1;
  }

  /** Share of the scale at a value, within 0 and 1. */
  share(value) {
    return Math.min(1, Math.max(0, (this.by(value) - this.start) / this.length));
  }

  /** Red, green, blue of a value, 0 to 255. */
  colour(value) {
    const row = 3 * Math.round(255 * this.share(value));
    return this.table.subarray(row, row + 3);
  }

  /** Positions and texts of the ticks of the legend. */
  ticks() {
    const { low, high, log, names } = this.mode;
    if (!names) return (log ? powersOfTen : roundTicks)(low, high, 5).map((v) => [this.share(v), inFigures(v)]);
    const every = Math.ceil(names.length / 4);
    return names.map((name, k) => [(k + 0.5) / names.length, name]).filter((_, k) => k % every === 0);
  }

  /** Show the scale above the view. */
  showLegend() {
    const stops = [];
    for (let k = 0; k < 256; k++) stops.push(`rgb(${this.table.subarray(3 * k, 3 * k + 3).join(" ")})`);
    const colours = make("div", { class: "colours" }), ticks = make("div", { class: "ticks" });
    colours.style.background = `linear-gradient(to right, ${stops.join(",")})`;
    const texts = this.ticks();
    for (const [share, text] of texts) {
      const tick = make("span", {}, text);
      tick.style.left = `${100 * share}%`;
      ticks.append(tick);
    }
    const { label, keys } = this.mode, parts = [make("div", { class: "bar" }, colours, ticks)];
    for (const key of keys || []) {
      const box = make("i");
      box.style.background = `rgb(${key.colour.join(" ")})`;
      parts.push(make("span", { class: "key" }, box, key.label));
    }
    const words = texts.map(([, text]) => text);
    byId("legend").setAttribute("aria-label", `Colours: ${label}, from ${words[0]} to ${words.at(-1)}`);
    byId("legend").replaceChildren(make("span", { class: "name" }, label), ...parts);
  }
}

/** Fit a canvas to its place on the page; returns pixels of the device for one of the page. */
function fitCanvas(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  return ratio;
}

/** Curves over time below the slider: each has name, colour, times and values. */
class Trace {
  constructor(curves, label) {
    Object.assign(this, { curves, canvas: byId("trace"), left: 48, right: 8 });
    const values = curves.flatMap((curve) => curve.values), times = curves.flatMap((c) => c.times);
    this.range = [Math.min(...values), Math.max(...values)];
    if (this.range[0] === this.range[1]) this.range[1] += 1;
    this.span = [Math.min(...times), Math.max(...times)];
    const names = curves.filter((curve) => curve.name).map(({ name, colour }) => {
      const swatch = make("i");
      swatch.style.background = colour;
      return make("span", { class: "key" }, swatch, name);
    });
    byId("trace-names").append(make("span", {}, label), ...names);
  }

  across(time) {
    const room = this.canvas.clientWidth - this.left - this.right;
    return this.left + (room * (time - this.span[0])) / (this.span[1] - this.span[0] || 1);
  }

  upwards(value) {
    const [low, high] = this.range, height = this.canvas.clientHeight;
    return height - 8 - ((height - 16) * (value - low)) / (high - low);
  }

  draw(frame) {
    const ratio = fitCanvas(this.canvas), pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, this.canvas.clientWidth, this.canvas.clientHeight);
    pen.font = "12px system-ui, sans-serif";
    this.drawGrid(pen);
    for (const curve of this.curves) this.drawCurve(pen, curve, frame);
  }

  drawGrid(pen) {
    const end = this.canvas.clientWidth - this.right;
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    for (const tick of roundTicks(...this.range, 3)) {
      const y = this.upwards(tick);
      pen.strokeStyle = style("--line");
      pen.beginPath();
      pen.moveTo(this.left, y);
      pen.lineTo(end, y);
      pen.stroke();
      pen.fillStyle = style("--soft");
      pen.textAlign = "right";
      pen.fillText(inFigures(tick), this.left - 6, y);
    }
  }

  drawCurve(pen, { times, values, colour }, frame) {
    pen.strokeStyle = pen.fillStyle = colour || style("--mark");
    pen.lineWidth = 1.6;
    pen.beginPath();
    times.forEach((time, k) => pen.lineTo(this.across(time), this.upwards(values[k])));
    pen.stroke();
    pen.beginPath();
    pen.arc(this.across(times[frame]), this.upwards(values[frame]), 4, 0, 7);
    pen.fill();
  }

  /** Frame nearest to a place on the canvas. */
  frameAt(x) {
    const away = this.curves[0].times.map((time) => Math.abs(this.across(time) - x));
    return away.indexOf(Math.min(...away));
  }
}

const ICONS = { play: "M3 1 L14 8 L3 15 Z", pause: "M3 1 h4 v14 h-4 Z M9 1 h4 v14 h-4 Z" };

/** The player: draw(frame) draws a frame; times are in view.unit, one a frame. */
class Player {
  constructor(times, draw, trace, first) {
    Object.assign(this, { times, drawView: draw, trace, playing: false });
    const steps = times.slice(1).map((time, k) => time - times[k]).filter((step) => step > 0);
    const least = Math.min(...steps, 1);
    this.decimals = Math.min(4, Math.max(0, Math.ceil(-Math.log10(least) - 0.01) + 1));
    this.interval = Math.min(120, Math.max(33, 6000 / times.length));
    this.scrub = byId("scrub");
    this.scrub.max = times.length - 1;
    this.listen();
    const named = /frame=(\d+)/.exec(location.hash);
    this.setPlaying(false);
    this.go(named ? Number(named[1]) : first);
  }

  /** Show a frame, the nearest there is. */
  go(frame) {
    this.frame = Math.min(this.times.length - 1, Math.max(0, frame));
    const text = `${this.times[this.frame].toFixed(this.decimals)} ${view.unit}`;
    this.scrub.value = this.frame;
    this.scrub.setAttribute("aria-valuetext", text);
    byId("time").textContent = text;
    this.draw();
  }

  draw() {
    this.drawView(this.frame);
    if (this.trace) this.trace.draw(this.frame);
  }

  setPlaying(playing) {
    this.playing = playing;
    byId("play-icon").setAttribute("d", playing ? ICONS.pause : ICONS.play);
    byId("play").setAttribute("aria-label", playing ? "Pause" : "Play");
    if (!playing) return;
    if (this.frame === this.times.length - 1) this.go(0);
    this.shown = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    if (now - this.shown >= this.interval) {
      this.shown = now;
      this.go(this.frame + 1);
      if (this.frame === this.times.length - 1) return this.setPlaying(false);
    }
    requestAnimationFrame((later) => this.tick(later));
  }

  listen() {
    byId("play").addEventListener("click", () => this.setPlaying(!this.playing));
    this.scrub.addEventListener("input", () => this.stopAt(Number(this.scrub.value)));
    document.addEventListener("keydown", (event) => this.press(event));
    new ResizeObserver(() => this.draw()).observe(byId("stage"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    if (!this.trace) return void (byId("trace").hidden = true);
    const move = (event) => event.buttons && this.stopAt(this.trace.frameAt(event.offsetX));
    for (const name of ["pointerdown", "pointermove"]) byId("trace").addEventListener(name, move);
  }

  stopAt(frame) {
    this.setPlaying(false);
    this.go(frame);
  }

  press(event) {
    const kind = event.target.type || event.target.tagName;
    if (event.ctrlKey || event.altKey || event.metaKey || event.shiftKey) return;
    const own = { " ": /button|checkbox|select/i, other: /range|select/i };
    if ((own[event.key] || own.other).test(kind) && event.target !== this.scrub) return;
    const last = this.times.length - 1;
    const frames = { ArrowLeft: this.frame - 1, ArrowRight: this.frame + 1, Home: 0, End: last };
    if (event.key === " ") this.setPlaying(!this.playing);
    else if (event.key in frames) this.stopAt(frames[event.key]);
    else return;
    event.preventDefault();
  }
}
