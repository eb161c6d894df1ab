const START = 0.03, LEVEL = 0.01, END = 4, PITCH = 40, GUESSES = { sooner: "falls silent sooner", later: "swings for longer", same: "sounds the same" };
const BOXES = [["fixed", "red"], ["free", "blue"]], { dt, width, grain, container } = data;
let number = Math.min(60, Math.max(0, +(address.get("grains") ?? 30))), clearance = Math.min(90, Math.max(2, +(address.get("room") ?? 78)));
let boxes = [], curves = [], swings = [], rattle = 0, acceleration = 0, shaking = false, begun = false;

function renew() {
  const places = rowsOf(number, data), columns = Math.floor(width / (2.05 * grain.radius)), layers = Math.ceil(number / columns);
  const height = 2 * grain.radius * layers + 1e-3 * clearance;
  // Small speeds apart, or grains would fall in columns for ever.
  const velocities = places.map((_, k) => 0.01 * Math.sin(12.9898 * (k + 1)));
  boxes = BOXES.map(([name]) => new Damper(data, places, { free: name === "free", height, displacement: shaking ? 0 : START, velocities }));
  curves = BOXES.map(() => []);
  swings = BOXES.map(() => ({ count: 0, over: true, last: 0 }));
  begun = false;
}

function note(k, time) {
  const box = boxes[k], seen = swings[k];
  curves[k].push([time, 1e3 * box.x]);
  // A swing is a passage through the middle downwards, with more than the level left.
  if (seen.over && box.x < 0) {
    seen.over = false;
    if (box.swing > LEVEL) Object.assign(seen, { count: seen.count + 1, last: time });
  } else if (box.x > 0) seen.over = true;
}

const play = animation(() => {
  rattle = 0;
  for (let k = 0; k < 833; k++) {
    boxes.forEach((box) => box.step(acceleration));
    rattle += Math.abs(boxes[1].impulse);
    if (k % 60 === 0) boxes.forEach((box, which) => note(which, box.steps * dt));
  }
  if (shaking) curves.forEach((curve) => curve.length > 3300 && curve.splice(0, curve.length - 3300));
  sounds();
  show();
  return shaking || boxes[0].steps * dt < END || hush();
});

function show() {
  draw();
  drawDecay();
  const [fixed, free] = swings, ended = boxes[0].steps * dt >= END && !shaking;
  element("swings").textContent = begun ? `${free.count} free, ${fixed.count} fixed` : "Let them go.";
  element("time").textContent = begun ? `after ${(boxes[0].steps * dt).toFixed(1)} s, let go at 30 mm` : "From 30 mm above their rest.";
  keys(element("tones"), BOXES.map(([name, colour], k) => [colour, `${name} grains`, `${(PITCH * pitchOf(boxes[k])).toFixed(0)} Hz`]));
  const truth = !ended ? null : free.count < fixed.count ? "sooner" : free.count > fixed.count ? "later" : "same";
  judge(truth, truth && `${free.count} swings with free grains, ${fixed.count} with fixed ones.`);
  document.body.dataset.swings = swings.map((one) => one.count).join();
}

const pitchOf = (box) => Math.sqrt(container.stiffness / box.mass) / (2 * Math.PI);

// Sound: a tone for each box, and noise as strong as the blows.
let audio = null;
function listen() {
  if (audio) audio.context.resume();
  if (audio || !element("sound").checked || !window.AudioContext) return;
  const context = new AudioContext(), to = (node) => {
    const gain = context.createGain();
    gain.gain.value = 0;
    node.connect(gain).connect(context.destination);
    node.start();
    return gain.gain;
  };
  const noise = context.createBuffer(1, context.sampleRate, context.sampleRate), samples = noise.getChannelData(0);
  for (let k = 0; k < samples.length; k++) samples[k] = 2 * Math.random() - 1;
  const source = Object.assign(context.createBufferSource(), { buffer: noise, loop: true });
  const tones = BOXES.map(() => context.createOscillator());
  audio = { context, tones, gains: tones.map(to), blows: to(source) };
}

function sounds() {
  if (!audio) return;
  const now = audio.context.currentTime, on = element("sound").checked ? 1 : 0;
  boxes.forEach((box, k) => {
    audio.tones[k].frequency.setTargetAtTime(PITCH * pitchOf(box), now, 0.01);
    audio.gains[k].setTargetAtTime(on * Math.min(0.22, (0.2 * Math.max(0, box.swing - 5e-4)) / START), now, 0.02);
  });
  audio.blows.setTargetAtTime(on * Math.min(0.2, 8 * rattle), now, 0.01);
}

function hush() {
  if (audio) for (const gain of [...audio.gains, audio.blows]) gain.setTargetAtTime(0, audio.context.currentTime, 0.05);
  return false;
}

const draw = drawn(element("boxes"), [0.5, 0.8], (context, wide, high) => {
  const scale = Math.min((0.34 * wide) / width, (0.93 * high - 40) / (boxes[0].height + 0.07)), rest = 0.93 * high - 0.035 * scale;
  BOXES.forEach(([name, colour], k) => {
    const box = boxes[k], left = wide * (0.27 + 0.46 * k) - 0.5 * width * scale, floor = rest - box.x * scale, top = floor - box.height * scale;
    spring(context, left + 0.5 * width * scale, 0, top);
    context.fillStyle = colours.page;
    context.fillRect(left, top, width * scale, box.height * scale);
    context.fillStyle = colours[colour];
    for (let n = 0; n < box.count; n++) {
      const place = name === "free" ? [box.places[2 * n], box.places[2 * n + 1] - box.x] : [fixed[2 * n] - 0.5 * width, fixed[2 * n + 1]];
      context.beginPath();
      context.arc(left + (place[0] + 0.5 * width) * scale, floor - place[1] * scale, grain.radius * scale, 0, 7);
      context.fill();
    }
    context.strokeStyle = colours.text;
    context.lineWidth = 3;
    context.strokeRect(left, top, width * scale, box.height * scale);
    context.fillStyle = colours.text;
    context.textAlign = "center";
    context.font = "600 16px system-ui, sans-serif";
    context.fillText(name, left + 0.5 * width * scale, high - 8);
  });
});

function spring(context, x, from, to) {
  context.strokeStyle = colours.soft;
  context.lineWidth = 2;
  line(context, Array.from({ length: 25 }, (_, k) => [x + (k > 1 && k < 23 ? (k % 2 ? 11 : -11) : 0), from + ((to - from) * k) / 24]));
}

const drawDecay = drawn(element("decay"), [0.3, 0.6], (context, wide, high) => {
  const box = { left: 52, top: 30, width: wide - 64, height: high - 80 }, now = boxes[0].steps * dt, from = Math.max(0, now - END);
  const times = [0, 1, 2, 3, 4].map((t) => Math.ceil(from) + t).filter((t) => t <= from + END);
  const place = axes(context, box, { from, to: from + END, ticks: times.map((t) => [t, `${t}`]), name: "time [s]" }, { from: -32, to: 32, ticks: [[-30, "-30"], [-10, "-10"], [10, "10"], [30, "30"]], name: "displacement [mm]" });
  context.lineWidth = 2;
  curves.forEach((curve, k) => {
    context.strokeStyle = colours[BOXES[k][1]];
    context.setLineDash(k ? [] : [5, 4]);
    line(context, curve.filter(([t]) => t >= from).map(([t, x]) => [place.x(t), place.y(Math.max(-32, Math.min(32, x)))]));
  });
  context.setLineDash([]);
});

const letGo = () => {
  listen();
  renew();
  begun = true;
  play();
};
let fixed = rowsOf(number, data);
function changed() {
  fixed = rowsOf(number, data);
  remember({ grains: number, room: clearance });
  if (begun && !shaking) letGo();
  else renew();
  show();
}
slider("number", (value) => `${value}`, (value) => {
  number = value;
  changed();
})(number);
slider("clearance", (value) => `${value} mm`, (value) => {
  clearance = value;
  changed();
})(clearance);
element("go").addEventListener("click", () => {
  shaking = false;
  letGo();
});
element("sound").addEventListener("change", listen);

// Where the browser tells how the phone is moved, it moves what both boxes hang on.
if (window.DeviceMotionEvent && matchMedia("(pointer: coarse)").matches) element("shake").hidden = false;
element("shake").addEventListener("click", async () => {
  const ask = DeviceMotionEvent.requestPermission;
  if (ask && (await ask.call(DeviceMotionEvent)) !== "granted") return;
  addEventListener("devicemotion", (event) => (acceleration = shaking ? -((event.acceleration || {}).y || 0) : 0));
  shaking = true;
  letGo();
});
ask(GUESSES, show);
renew();
show();
// A link may lead to a time [s] after both were let go.
if (address.get("at")) {
  begun = true;
  while (boxes[0].steps * dt < Math.min(END, +address.get("at"))) {
    boxes.forEach((box) => box.step());
    if (boxes[0].steps % 60 === 0) boxes.forEach((box, which) => note(which, box.steps * dt));
  }
  show();
}
