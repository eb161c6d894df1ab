const canvas = element("plate"), REACH = 0.09, END = 12e-3, SETTLED = 1e-3;
const EFFECTS = { contact: "contact", friction: "friction", softening: "softening and breaking" };
const ENERGIES = [["motion", "blue", "motion"], ["springs", "sky", "springs"], ["dashpots", "rest", "dashpots"], ["friction", "violet", "friction and slip"], ["cracks", "orange", "cracks"]];
const PLACES = { near: "on the side that is struck", far: "on the far side", rim: "at the rim" };
const off = new Set((address.get("off") || "").split(",").filter((name) => EFFECTS[name]));
const made = (effects) => solidOf(data, { dt: data.dt, sleep: data.sleep, effects });
const view = { turn: turnOf(-20, 18), middle: [0.255, 0.17, 0.02], distance: 1.2 };
let plate, whole, faces = [], aim = [0.255, 0.17], aimed = false, speed = +address.get("speed") || 15, blows = [];

function renew() {
  plate = made(Object.fromEntries([...off].map((name) => [name, false])));
  whole = off.size ? made({}) : null;
  blows = [];
}

// Velocities of a blow at a place: along the view, less around it.
function blow(solid, [x, y], size) {
  const velocity = new Float64Array(3 * solid.count);
  for (let i = 0; i < solid.count; i++) {
    const square = (solid.centre[3 * i] - x) ** 2 + (solid.centre[3 * i + 1] - y) ** 2;
    velocity[3 * i + 2] = -size * Math.max(0, 1 - square / REACH ** 2);
  }
  return velocity;
}

function strike(place, size) {
  blows.push([place, size]);
  for (const solid of [plate, whole]) if (solid) solid.strike(blow(solid, place, size));
  remember({ tap: place.map((x) => x.toFixed(3)).join(), speed: size, off: [...off].join() });
  aimed = false;
  play();
}

// Slow at first, as the wave runs: each frame takes a share of the steps so far.
const play = animation((frame) => {
  const wanted = Math.max(1, Math.round(0.03 * plate.steps));
  workFor(11, wanted, () => {
    plate.step();
    if (whole) whole.step();
  });
  const on = plate.steps * data.dt < END;
  // Numbers change too fast to be read in every frame.
  if (frame % 6 && on) draw();
  else show();
  return on;
});

// Bits of what has acted in a body: 1 softening, 2 slip, 4 contact, 8 friction.
function actedIn(solid) {
  const bits = Uint8Array.from(solid.bodyActed);
  for (let b = 0; b < solid.bonds; b++) for (const face of [solid.faces[2 * b], solid.faces[2 * b + 1]]) bits[face >> 2] |= solid.acted[b];
  return bits;
}

function shade(bits, awake) {
  if (bits & 8) return "violet";
  if (bits & 4) return "red";
  if (bits & 1) return "orange";
  return bits & 2 ? "sky" : awake ? "body" : "rest";
}

function show() {
  const bits = actedIn(plate), count = (test) => bits.reduce((sum, one, i) => sum + (test(one, i) ? 1 : 0), 0);
  draw();
  const struck = blows.length > 0, ms = 1e3 * plate.steps * data.dt;
  element("broken").textContent = struck ? `${plate.brokenCount} of ${plate.bonds} bonds broke` : "Strike it.";
  element("time").textContent = struck ? `${ms.toFixed(ms < 1 ? 2 : 1)} ms after the first blow` : "One blow lasts a few thousandths of a second.";
  const energy = plate.energy(), parts = ENERGIES.map(([name, colour, words]) => [colour, words, struck ? Math.max(0, energy[name]) / plate.given : 0]);
  shares(element("shares"), parts.map(([colour, , share]) => [colour, share]));
  keys(element("energies"), parts.map(([colour, words, share]) => [colour, words, struck ? percent(share) : "–"]));
  keys(element("acting"), [["rest", "asleep", count((_, i) => !plate.awake[i])], ["orange", "softens", count((one) => one & 1)], ["sky", "bonds slip", count((one) => one & 2)], ["red", "touches", count((one) => one & 4)], ["violet", "rubs", count((one) => one & 8)]]);
  element("error").textContent = whole && struck ? compared() : "The plate with all effects then runs beside it, unseen, under the same blow.";
  const answer = struck && plate.steps * data.dt >= SETTLED ? mostly(whole || plate) : null;
  judge(answer && answer.place, answer && `${answer.count} of ${answer.all} bonds broke ${PLACES[answer.place]}.`);
  document.body.dataset.broken = plate.brokenCount;
}

function compared() {
  let most = 0, error = 0;
  for (let k = 0; k < plate.x.length; k++) {
    most = Math.max(most, Math.abs(whole.x[k] - whole.centre[k]));
    error = Math.max(error, Math.abs(whole.x[k] - plate.x[k]));
  }
  return `Without ${[...off].map((name) => EFFECTS[name]).join(" and ")}: places are ${percent(error / most)} off, and ${plate.brokenCount} bonds break in place of ${whole.brokenCount}.`;
}

// Where most bonds broke.
function mostly(solid) {
  const found = { near: 0, far: 0, rim: 0 };
  for (let b = 0; b < solid.bonds; b++) {
    if (!solid.broken[b]) continue;
    const [i, j] = [solid.faces[2 * b] >> 2, solid.faces[2 * b + 1] >> 2], z = 0.5 * (solid.centre[3 * i + 2] + solid.centre[3 * j + 2]);
    found[solid.held[i] || solid.held[j] ? "rim" : z > 0.03 ? "near" : "far"]++;
  }
  const place = Object.keys(found).reduce((best, name) => (found[name] > found[best] ? name : best));
  return found[place] ? { place, count: found[place], all: solid.brokenCount } : null;
}

const draw = drawn(canvas, [0.66, 0.8], (context, width, height) => {
  Object.assign(view, { scale: width * 1.55, x: width * 0.49, y: height * 0.49 });
  const bits = actedIn(plate);
  faces = drawSolid(context, plate, view, (i) => colours[shade(bits[i], plate.awake[i])]);
  if (aimed || (!blows.length && document.activeElement === canvas)) ring(context);
});

// The aim, as large as the blow is hard.
function ring(context) {
  const [right, up] = along(view.turn, minus([...aim, 0.06], view.middle)), x = view.x + view.scale * right, y = view.y - view.scale * up;
  context.lineWidth = 4;
  context.strokeStyle = colours.mark;
  context.beginPath();
  context.arc(x, y, 12 + 3 * speed, 0, 7);
  context.stroke();
  line(context, [[x - 6, y], [x + 6, y]]);
  line(context, [[x, y - 6], [x, y + 6]]);
}

// Place on the plate under a point of the screen, from the nearest face there; null beside it.
function placeUnder(px, py) {
  for (let k = faces.length - 1; k >= 0; k--) {
    const [face, ax, ay, bx, by, cx, cy] = faces[k], all = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
    const b = ((px - ax) * (cy - ay) - (cx - ax) * (py - ay)) / all, c = ((bx - ax) * (py - ay) - (px - ax) * (by - ay)) / all;
    if (b < 0 || c < 0 || b + c > 1) continue;
    const corners = FACES[face & 3].map((p) => row(plate.points, plate.tetrahedra[4 * (face >> 2) + p]));
    return [0, 1].map((axis) => (1 - b - c) * corners[0][axis] + b * corners[1][axis] + c * corners[2][axis]);
  }
  return null;
}

let pressedAt = null;
canvas.addEventListener("pointerdown", (event) => {
  const place = placeUnder(event.offsetX, event.offsetY);
  if (!place) return;
  canvas.setPointerCapture(event.pointerId);
  Object.assign(aim, place);
  pressedAt = [event.offsetX, event.offsetY, speed];
  aimed = true;
  draw();
});
canvas.addEventListener("pointermove", (event) => {
  if (!pressedAt) return;
  const way = Math.hypot(event.offsetX - pressedAt[0], event.offsetY - pressedAt[1]);
  speed = Math.min(25, Math.round(2 * (way > 8 ? pressedAt[2] + 0.08 * way : pressedAt[2])) / 2);
  setSpeed(speed);
  draw();
});
canvas.addEventListener("pointerup", () => {
  if (pressedAt) strike([...aim], speed);
  pressedAt = null;
});
canvas.addEventListener("keydown", (event) => {
  const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (way) way.forEach((step, k) => (aim[k] = Math.min([0.5, 0.33][k], Math.max(0.01, aim[k] + 0.01 * step))));
  else if (event.key === "Enter" || event.key === " ") strike([...aim], speed);
  else return;
  event.preventDefault();
  aimed = Boolean(way);
  draw();
});
canvas.addEventListener("focus", draw);
canvas.addEventListener("blur", draw);

const setSpeed = slider("speed", (value) => `${value} m/s`, (value) => (speed = value));
setSpeed(speed);
element("again").addEventListener("click", () => {
  remember({ tap: "" });
  renew();
  show();
});
for (const [name, words] of Object.entries(EFFECTS)) {
  const label = document.createElement("label"), input = document.createElement("input");
  label.className = "switch";
  Object.assign(input, { type: "checkbox", checked: !off.has(name) });
  input.addEventListener("change", () => {
    input.checked ? off.delete(name) : off.add(name);
    const again = blows;
    renew();
    show();
    if (again.length) strike(...again[0]);
  });
  label.append(input, words);
  element("switches").append(label);
}
ask(PLACES, show);
renew();
show();
const given = (address.get("tap") || "").split(",").map(Number);
if (given.length === 2 && given.every(Number.isFinite)) {
  strike(given, speed);
  // A link may lead to a time [ms] after its blow.
  while (plate.steps * data.dt < Math.min(END, 1e-3 * +address.get("at"))) for (const solid of [plate, whole]) if (solid) solid.step();
  show();
}
