"use strict";
// What the pages share: data of the package, the address, guesses, canvases, drawing of bodies.

const element = (id) => document.getElementById(id);
const data = JSON.parse(element("data").textContent);

// Array of what the package packed (taichi_dem/kit/viewer).
function unpack({ kind, data: text }) {
  const kinds = { float32: Float32Array, uint16: Uint16Array };
  return new kinds[kind](Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
}

const solidOf = (mesh, options) =>
  new Solid(Float64Array.from(unpack(mesh.points)), Int32Array.from(unpack(mesh.tetrahedra)), mesh.material, { held: mesh.held, ...options });

// A push of the left end that fades along the bar, so that neighbours differ little.
function pushOf(solid) {
  const velocity = new Float64Array(3 * solid.count);
  for (let i = 0; i < solid.count; i++) velocity[3 * i] = solid.centre[3 * i] < 0.2 ? Math.cos((Math.PI * solid.centre[3 * i]) / 0.4) ** 2 : 0;
  return velocity;
}

// State of the page is in its address, so that a link shows what its sender saw.
const address = new URLSearchParams(location.hash.slice(1));
function remember(values) {
  for (const [name, value] of Object.entries(values)) value === "" ? address.delete(name) : address.set(name, value);
  history.replaceState(null, "", `#${address}`);
}

// Colours of the page by name, which change with light and dark.
const colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["page", "text", "soft", "line", "card", "mark", "rest", "body", "edge", "orange", "sky", "green", "red", "violet", "blue", "good", "bad"])
    colours[name] = style.getPropertyValue(`--${name}`).trim();
}
readColours();

// Calls draw(context, width, height) with CSS pixels: at once, when asked, on another size or scheme.
function drawn(canvas, aspect, draw) {
  const context = canvas.getContext("2d");
  const again = () => {
    const width = canvas.clientWidth, height = Math.round(width * (width < 600 ? aspect[1] : aspect[0])), dense = Math.min(2, devicePixelRatio || 1);
    canvas.style.height = `${height}px`;
    if (canvas.width !== Math.round(width * dense) || canvas.height !== Math.round(height * dense)) {
      canvas.width = Math.round(width * dense);
      canvas.height = Math.round(height * dense);
    }
    context.setTransform(dense, 0, 0, dense, 0, 0);
    context.clearRect(0, 0, width, height);
    draw(context, width, height);
  };
  addEventListener("resize", again);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readColours();
    again();
  });
  return again;
}

// Calls each(frame) in every frame until it returns false. Returns a function that starts it (again).
function animation(each) {
  let running = false, frame = 0;
  const turn = () => {
    running = each(frame++) !== false;
    if (running) requestAnimationFrame(turn);
  };
  return () => {
    frame = 0;
    if (!running) requestAnimationFrame(turn);
    running = true;
  };
}

// Calls work() until it returns false, a number of times is done, or a time [ms] is over.
function workFor(most, count, work) {
  const end = performance.now() + most;
  for (let k = 0; k < count; k++) if (work() === false || performance.now() > end) return;
}

// A guess before the answer: radio buttons, one an option {key: words}.
function ask(options, changed = () => {}) {
  const box = document.createElement("div");
  box.className = "choices";
  for (const [key, words] of Object.entries(options)) {
    const label = document.createElement("label"), input = document.createElement("input");
    Object.assign(input, { type: "radio", name: "guess", value: key, checked: address.get("guess") === key });
    input.addEventListener("change", () => {
      remember({ guess: key });
      changed();
    });
    label.append(input, words);
    box.append(label);
  }
  element("guess").append(box);
}

// Says whether the guess was right: true, false, or null while nobody knows.
function judge(truth, words) {
  const guess = address.get("guess"), place = element("verdict");
  place.className = `verdict ${truth && guess ? (guess === truth ? "right" : "wrong") : ""}`;
  place.textContent = !truth ? "" : !guess ? words : guess === truth ? `You were right: ${words}` : `Not so: ${words}`;
}

// A slider whose value has words; returns a function that sets it.
function slider(id, words, changed) {
  const input = element(id), output = element(`${id}-value`);
  const show = () => {
    output.textContent = words(+input.value);
    input.setAttribute("aria-valuetext", output.textContent);
  };
  input.addEventListener("input", () => {
    show();
    changed(+input.value);
  });
  show();
  return (value) => {
    input.value = value;
    show();
  };
}

const percent = (share) => (share > 0 && share < 0.001 ? "< 0.1 %" : `${(100 * share).toFixed(share < 0.0995 ? 1 : 0)} %`);

// A row of a key: colour, words and a number; shares: bars of a whole.
function keys(place, rows) {
  place.replaceChildren(...rows.map(([colour, words, number]) => {
    const line = document.createElement("span"), [mark, name, value] = ["i", "span", "b"].map((kind) => document.createElement(kind));
    mark.style.background = `var(--${colour})`;
    name.textContent = words;
    value.textContent = number;
    line.append(mark, name, value);
    return line;
  }));
}
function shares(place, rows) {
  while (place.children.length < rows.length) place.append(document.createElement("i"));
  rows.forEach(([colour, share], k) => {
    place.children[k].style.background = `var(--${colour})`;
    place.children[k].style.width = `${Math.max(0, 100 * share)}%`;
  });
}

const LIGHT = [-0.33, 0.52, 0.79];

// A colour between black, itself and white: light from -1 to 1.
function lit(hex, light) {
  const n = parseInt(hex.slice(1), 16), to = light > 0 ? 255 : 0, s = Math.abs(light);
  const part = (shift) => Math.round(((n >> shift) & 255) * (1 - s) + to * s);
  return `rgb(${part(16)},${part(8)},${part(0)})`;
}

// A colour between two of six digits.
function mixed(from, to, share) {
  const [a, b] = [from, to].map((one) => parseInt(one.slice(1), 16));
  const part = (shift) => Math.round(((a >> shift) & 255) * (1 - share) + ((b >> shift) & 255) * share);
  return `#${((1 << 24) | (part(16) << 16) | (part(8) << 8) | part(0)).toString(16).slice(1)}`;
}

// Draws the faces of a solid that show, the far ones first. view: turn (rows to the right, up and
// towards the eye), middle [m], distance of the eye [m], scale [pixels / m] and place of the middle.
// fill(i): colour of a body. Returns what is drawn: [face, six screen coordinates], the near last.
function drawSolid(context, solid, view, fill, magnify = 1) {
  const { x, R, centre, points, tetrahedra } = solid, n = solid.count, at = new Float64Array(12 * n), found = [];
  for (let i = 0; i < n; i++) {
    for (let k = 0; k < 4; k++) {
      const p = 3 * tetrahedra[4 * i + k], a = points[p] - centre[3 * i], b = points[p + 1] - centre[3 * i + 1], c = points[p + 2] - centre[3 * i + 2];
      const world = [0, 1, 2].map((r) => {
        const o = 9 * i + 3 * r, rest = centre[3 * i + r] + [a, b, c][r];
        return rest + magnify * (x[3 * i + r] + R[o] * a + R[o + 1] * b + R[o + 2] * c - rest) - view.middle[r];
      });
      const [right, up, near] = along(view.turn, world), scale = (view.scale * view.distance) / (view.distance - near);
      at[12 * i + 3 * k] = view.x + scale * right;
      at[12 * i + 3 * k + 1] = view.y - scale * up;
      at[12 * i + 3 * k + 2] = near;
    }
  }
  for (let face = 0; face < 4 * n; face++) {
    const bond = solid.bondOf[face];
    if (bond >= 0 && !solid.broken[bond]) continue;
    const [a, b, c] = FACES[face & 3].map((k) => 12 * (face >> 2) + 3 * k);
    const turned = (at[b] - at[a]) * (at[c + 1] - at[a + 1]) - (at[c] - at[a]) * (at[b + 1] - at[a + 1]);
    if (turned < 0) found.push([face, at[a], at[a + 1], at[b], at[b + 1], at[c], at[c + 1], at[a + 2] + at[b + 2] + at[c + 2]]);
  }
  found.sort((a, b) => a[7] - b[7]);
  context.lineJoin = "round";
  for (const [face, ...p] of found) {
    const i = face >> 2, corners = FACES[face & 3].map((k) => row(points, tetrahedra[4 * i + k]));
    const normal = along(view.turn, along(matrix(R, i), unit(cross(minus(corners[1], corners[0]), minus(corners[2], corners[0])))));
    const light = Math.max(0, dot(normal, LIGHT));
    context.beginPath();
    context.moveTo(p[0], p[1]);
    context.lineTo(p[2], p[3]);
    context.lineTo(p[4], p[5]);
    context.closePath();
    context.fillStyle = lit(fill(i, face), 0.5 * light - 0.42);
    context.strokeStyle = solid.bondOf[face] >= 0 ? colours.text : colours.edge;
    context.lineWidth = solid.bondOf[face] >= 0 ? 1.4 : 0.6;
    context.fill();
    context.stroke();
  }
  return found;
}

// A turn about the vertical and then the horizontal of the screen [degrees].
function turnOf(yaw, pitch) {
  const [a, b] = [(yaw * Math.PI) / 180, (pitch * Math.PI) / 180], [c, s, d, t] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
  return [[c, 0, -s], [-t * s, d, -t * c], [d * s, t, d * c]];
}

// Axes of a chart: place of a value in a box, lines and words of its ticks.
function axes(context, box, across, up) {
  const part = ({ from, to, log }, value) => (log ? Math.log(value / from) / Math.log(to / from) : (value - from) / (to - from));
  const place = { x: (value) => box.left + box.width * part(across, value), y: (value) => box.top + box.height * (1 - part(up, value)) };
  context.font = "14px system-ui, sans-serif";
  context.strokeStyle = colours.line;
  context.fillStyle = colours.soft;
  context.lineWidth = 1;
  for (const [value, words] of across.ticks) {
    const x = Math.round(place.x(value)) + 0.5;
    line(context, [[x, box.top], [x, box.top + box.height]]);
    context.textAlign = "center";
    context.fillText(words, x, box.top + box.height + 18);
  }
  for (const [value, words] of up.ticks) {
    const y = Math.round(place.y(value)) + 0.5;
    line(context, [[box.left, y], [box.left + box.width, y]]);
    context.textAlign = "right";
    context.fillText(words, box.left - 8, y + 5);
  }
  context.textAlign = "center";
  context.fillText(across.name, box.left + box.width / 2, box.top + box.height + 40);
  context.textAlign = "left";
  context.fillText(up.name, Math.max(4, box.left - 44), box.top - 12);
  return place;
}

function line(context, points) {
  context.beginPath();
  points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.stroke();
}
