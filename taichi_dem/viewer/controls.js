"use strict";
// Page of the block: what stands around the view, the options, and how the block is turned.

const MAGNIFICATIONS = [0, 1, 2, 3, 5];
for (let power = 10; power <= 10000; power *= 10) MAGNIFICATIONS.push(power, 2 * power, 3 * power, 5 * power);
const SVG = "http://www.w3.org/2000/svg";
const stage = byId("stage");

/** An element of a drawing with attributes. */
function drawn(tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

/** The three axes in a corner of the view. */
class Axes {
  constructor() {
    this.root = drawn("svg", { id: "overlay", width: 76, height: 76, viewBox: "-38 -38 76 76", "aria-hidden": "true" });
    this.axes = ["#d55e00", "#009e73", "#0072b2"].map((stroke, k) => {
      const line = drawn("line", { stroke, "stroke-width": 2.5, "stroke-linecap": "round" });
      const text = drawn("text", {});
      text.textContent = "xyz"[k];
      this.root.append(line, text);
      return { line, text };
    });
  }

  draw(turn) {
    this.axes.forEach(({ line, text }, k) => {
      const [x, y] = [turn[3 * k], -turn[3 * k + 1]];
      line.setAttribute("x2", 24 * x);
      line.setAttribute("y2", 24 * y);
      text.setAttribute("x", 32 * x);
      text.setAttribute("y", 32 * y);
      // Letters of an axis that points at the viewer would lie on the others.
      text.style.opacity = Math.hypot(x, y) < 0.2 ? 0 : 1;
    });
  }
}

/** A bar as long as its number says. */
class ScaleBar {
  constructor() {
    this.root = make("div", { id: "scale-bar", "aria-hidden": "true" });
  }

  draw(pixels) {
    const power = 10 ** Math.floor(Math.log10(120 / pixels));
    const length = [5, 2, 1].map((factor) => factor * power).find((one) => one * pixels <= 120.01);
    const [unit, size] = [["km", 1e3], ["m", 1], ["mm", 1e-3], ["µm", 1e-6]].find((one) => length >= 0.0999 * one[1]) || ["nm", 1e-9];
    this.root.style.width = `${length * pixels}px`;
    this.root.textContent = `${inFigures(length / size)} ${unit}`;
  }
}

/** Turning, moving and zooming by mouse, touch and keys. */
class Handles {
  constructor(canvas, camera, redraw) {
    Object.assign(this, { canvas, camera, redraw, pointers: new Map() });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"])
      canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.press(event));
  }

  move(event) {
    const before = this.pointers.get(event.pointerId), now = [event.offsetX, event.offsetY];
    if (!before) return;
    const [right, down] = [now[0] - before[0], now[1] - before[1]];
    const other = [...this.pointers].find(([id]) => id !== event.pointerId);
    if (other) {
      const apart = (place) => Math.hypot(place[0] - other[1][0], place[1] - other[1][1]) || 1;
      this.camera.zoomBy(apart(now) / apart(before));
      this.shift(0.5 * right, 0.5 * down);
    } else if (event.shiftKey || event.buttons & 6) this.shift(right, down);
    else this.camera.turnBy(0.008 * right, 0.008 * down);
    this.pointers.set(event.pointerId, now);
    this.redraw();
  }

  shift(right, down) {
    this.camera.shift[0] += right / this.canvas.clientWidth;
    this.camera.shift[1] += down / this.canvas.clientHeight;
  }

  wheel(event) {
    // In the cell of a notebook the wheel goes on scrolling until the view was touched.
    if (window !== window.parent && document.activeElement !== this.canvas) return;
    event.preventDefault();
    this.camera.zoomBy(Math.exp(-0.0015 * event.deltaY));
    this.redraw();
  }

  press(event) {
    const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const zooms = { "+": 1.2, "=": 1.2, "-": 1 / 1.2 };
    if (event.key in zooms) this.camera.zoomBy(zooms[event.key]);
    else if (event.shiftKey && event.key in ways) this.camera.turnBy(...ways[event.key].map((way) => 0.1 * way));
    else return;
    event.preventDefault();
    this.redraw();
  }
}

/** The options below the player; returns what is chosen, which changes as the reader chooses. */
function makeOptions(camera, redraw) {
  const select = make("select", { id: "colour" });
  view.modes.forEach((mode, k) => select.append(make("option", { value: k }, mode.name)));
  const first = Math.max(0, MAGNIFICATIONS.findIndex((one) => one >= view.magnify));
  const slider = make("input", { type: "range", id: "magnify", min: 0, max: MAGNIFICATIONS.length - 1, value: first });
  const output = make("output", { for: "magnify" });
  const mesh = make("input", { type: "checkbox", id: "mesh", checked: "" });
  const buttons = Object.keys(LOOKS).map((name) => {
    const words = name === "3-D" ? "View from an angle" : `View along ${name}`;
    const button = make("button", { type: "button", "aria-label": words }, name);
    button.addEventListener("click", () => { camera.look(LOOKS[name]); redraw(); });
    return button;
  });
  byId("options").append(
    make("label", {}, "colour by", select), make("label", {}, "displacement", slider, output),
    make("label", {}, mesh, "elements"),
    make("span", { class: "buttons", role: "group", "aria-label": "View" }, "view", ...buttons));
  const chosen = {};
  const read = () => {
    chosen.mode = Number(select.value);
    chosen.magnify = MAGNIFICATIONS[slider.value];
    chosen.mesh = mesh.checked;
    output.textContent = chosen.magnify ? `× ${chosen.magnify}` : "× 0, at rest";
    slider.setAttribute("aria-valuetext", output.textContent);
    redraw();
  };
  for (const input of [select, slider, mesh]) input.addEventListener("input", read);
  return { chosen, read };
}

/** Say in the view why there is none. */
function fail(words) {
  stage.replaceChildren(make("p", { class: "failure", role: "alert" }, words));
}

function start() {
  const words = "The block. Drag it to turn it, or hold Shift and use the arrow keys.";
  const canvas = make("canvas", { tabindex: "0", role: "img", "aria-label": words });
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return fail("This browser does not offer WebGL 2, which the view needs.");
  canvas.addEventListener("webglcontextlost", () => fail("The graphics processor was reset: load the page again."));
  const axes = new Axes(), bar = new ScaleBar(), block = new BlockView(canvas, gl);
  stage.append(canvas, axes.root, bar.root);
  const trace = new Trace(view.curves, view.curveLabel);
  let player = null, legend = null;
  const options = makeOptions(block.camera, () => player && player.draw());
  const draw = (frame) => {
    const { mode, magnify, mesh } = options.chosen;
    Object.assign(block, { magnify, mesh });
    block.draw(frame, mode);
    axes.draw(block.camera.turn);
    bar.draw(block.pixels());
    if (legend !== mode) block.scales[(legend = mode)].showLegend();
  };
  options.read();
  player = new Player(view.times, draw, trace, view.times.length - 1);
  new Handles(canvas, block.camera, () => player.draw());
  byId("help").append("Drag to turn, wheel or pinch to zoom, right button or two fingers to move. ",
    make("span", { class: "keys" }, "Keys: space plays, arrows step, with Shift they turn the view, + and − zoom."));
}

start();
