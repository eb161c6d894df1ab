"use strict";
// Containers side by side: walls, particles, spring and base; lengths in mm, upwards positive.

const COILS = 9;
const scale = new ColourScale(view.speed);
const boxes = view.containers.map((one) => ({
  ...one, position: unpackFrames(one.position), speed: unpackFrames(one.speed),
}));
const hangs = view.mount === "spring";
const widest = Math.max(...boxes.map((one) => one.width));
const highest = Math.max(...boxes.map((one) => one.height));
const moves = boxes.flatMap((one) => [...one.lift, ...one.base]);
const swing = [Math.min(0, ...moves), Math.max(0, ...moves)];
const spring = 0.75 * Math.min(highest, widest);
// Room of a container with all that it does, and of its title below it.
const cell = { width: 1.3 * widest, height: highest + swing[1] - swing[0] + (hangs ? spring : 0) + 0.1 * highest };
const TITLE = 24;

/** Columns and pixels for a millimetre with which all containers are largest. */
function layout(width, height) {
  let best = { pixels: 0 };
  for (let columns = 1; columns <= boxes.length; columns++) {
    const rows = Math.ceil(boxes.length / columns);
    const pixels = Math.min(width / columns / cell.width, (height / rows - TITLE) / cell.height);
    if (pixels > best.pixels) best = { columns, rows, pixels };
  }
  return best;
}

/** A line through points [mm]; place turns them into pixels. */
function line(pen, points, place, close) {
  pen.beginPath();
  for (const point of points) pen.lineTo(...place(point));
  if (close) pen.closePath();
  pen.stroke();
}

/** Points of the spring from the base to the lid. */
function springPoints(middle, top, bottom) {
  const lead = 0.08 * spring, points = [[middle, top], [middle, top - lead]];
  for (let k = 0; k < 2 * COILS; k++) {
    const share = (k + 0.5) / (2 * COILS);
    points.push([middle + (k % 2 ? -1 : 1) * 0.1 * widest, top - lead + share * (bottom - top + 2 * lead)]);
  }
  return [...points, [middle, bottom + lead], [middle, bottom]];
}

function drawContainer(pen, box, frame, place, pixels) {
  const lift = box.lift[frame], base = box.base[frame], middle = 0.5 * box.width;
  const moved = ([x, y]) => place([x, y + lift]);
  pen.strokeStyle = style("--soft");
  pen.lineWidth = 1;
  pen.setLineDash([3, 4]);
  line(pen, [[-0.12 * box.width, 0], [1.12 * box.width, 0]], place);
  pen.setLineDash([]);
  drawParticles(pen, box, frame, moved, pixels);
  pen.strokeStyle = style("--ink");
  pen.lineWidth = 1.6;
  line(pen, box.outline, moved, true);
  const end = hangs ? box.height + spring + base : base - 0.02 * highest;
  if (hangs) {
    pen.lineWidth = 1.1;
    line(pen, springPoints(middle, end, box.height + lift), place);
  }
  pen.lineWidth = 4;
  line(pen, [[middle - 0.3 * box.width, end], [middle + 0.3 * box.width, end]], place);
}

function drawParticles(pen, box, frame, moved, pixels) {
  const position = box.position(frame), speed = box.speed(frame);
  pen.lineWidth = 0.7;
  pen.strokeStyle = "#222222";
  box.diameters.forEach((diameter, k) => {
    pen.beginPath();
    pen.arc(...moved([position[2 * k], position[2 * k + 1]]), 0.5 * diameter * pixels, 0, 7);
    pen.fillStyle = `rgb(${scale.colour(speed[k]).join(" ")})`;
    pen.fill();
    pen.stroke();
  });
}

function start() {
  const titles = view.containers.map((one) => one.title).join("; ");
  const canvas = make("canvas", { class: "still", role: "img", "aria-label": `Containers side by side: ${titles}` });
  byId("stage").append(canvas);
  scale.showLegend();
  const draw = (frame) => {
    const ratio = fitCanvas(canvas), pen = canvas.getContext("2d");
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const { columns, rows, pixels } = layout(width, height);
    const across = Math.min(width / columns, 2 * cell.width * pixels), down = cell.height * pixels + TITLE;
    const left = 0.5 * (width - columns * across), top = 0.5 * (height - rows * down);
    boxes.forEach((box, k) => {
      const x = left + across * ((k % columns) + 0.5), bottom = top + down * (Math.floor(k / columns) + 1);
      const floor = bottom - TITLE + (swing[0] - 0.05 * highest) * pixels, wall = x - 0.5 * box.width * pixels;
      drawContainer(pen, box, frame, (point) => [wall + point[0] * pixels, floor - point[1] * pixels], pixels);
      pen.font = "14px system-ui, sans-serif";
      pen.textAlign = "center";
      pen.fillStyle = style("--text");
      pen.fillText(box.title, x, bottom - 9);
    });
  };
  new Player(view.times, draw, new Trace(view.curves, view.curveLabel), 0);
  byId("help").append("The dashed line is the floor of the container at rest. ",
    make("span", { class: "keys" }, "Keys: space plays, arrows step."));
}

start();
