const METHODS = {
  explicit: { words: "explicit dashpots", colour: "red", theta: 0, steps: data.steps.explicit },
  mean: { words: "solved, mean velocity", colour: "blue", theta: 0.5, steps: data.steps.solved },
  last: { words: "solved, last velocity", colour: "green", theta: 1, steps: data.steps.solved },
};
const LOW = 1e-5, HIGH = 1;
let method = METHODS[address.get("method")] ? address.get("method") : "mean", dots = [], truth = null, queue = [];

// Way of the right end [m] after a run, and milliseconds that it took: the less of two tries.
function* running(theta, steps, tries = 2, more = {}) {
  let solid, least = Infinity;
  for (let k = 0; k < tries; k++) {
    const off = { contact: false, friction: false, softening: false, slip: false };
    solid = solidOf(data, { dt: data.until / steps, theta, effects: off, ...more });
    let ms = 0;
    const timed = (work) => {
      ms -= performance.now();
      work();
      ms += performance.now();
    };
    timed(() => solid.strike(pushOf(solid)));
    while (solid.steps < steps) {
      timed(() => {
        for (let left = Math.min(8, steps - solid.steps); left > 0; left--) solid.step();
      });
      yield;
    }
    least = Math.min(least, ms);
  }
  return { way: data.end.reduce((sum, i) => sum + solid.x[3 * i] - solid.centre[3 * i], 0) / data.end.length, ms: least };
}

// Works through the queue of runs, some milliseconds in a frame.
const work = animation(() => {
  workFor(12, Infinity, () => {
    if (!queue.length) return false;
    const made = queue[0].run.next();
    if (!made.done) return true;
    queue.shift().then(made.value);
    return queue.length > 0;
  });
  show();
  return queue.length > 0;
});

function enqueue(name, number) {
  const { theta, steps } = METHODS[name];
  queue.push({
    run: running(theta, steps[number]),
    then: ({ way, ms }) => dots.push({ name, number, ms, error: Math.max(LOW, Math.abs(way / truth - 1)) }),
  });
  work();
}

// Dots that no other beats in both time and error, by time.
function front() {
  return dots.filter((dot) => !dots.some((one) => one.ms <= dot.ms && one.error < dot.error)).sort((a, b) => a.ms - b.ms);
}

const cheapest = (name) => dots.filter((dot) => (!name || dot.name === name) && dot.error <= 0.01).sort((a, b) => a.ms - b.ms)[0];

function show() {
  draw();
  const last = dots[dots.length - 1], busy = queue.length > 0;
  element("last").textContent = last ? `${percentOf(last.error)} off` : "No run yet.";
  element("last-note").textContent = !truth ? "The true answer is being computed …" : last ? `in ${msOf(last.ms)}, ${METHODS[last.name].words}` : `The right end moves ${(1e6 * truth).toFixed(2)} µm.`;
  for (const id of ["run", "fill"]) element(id).disabled = busy;
  keys(element("prices"), Object.entries(METHODS).map(([name, { words, colour }]) => [colour, words, cheapest(name) ? msOf(cheapest(name).ms) : "–"]));
  const done = Object.keys(METHODS).every((name) => dots.some((dot) => dot.name === name)), best = done ? cheapest() : null;
  judge(best && best.name, best && `${METHODS[best.name].words}, ${msOf(best.ms)}.`);
  document.body.dataset.dots = dots.length;
}

const msOf = (ms) => (ms < 10 ? `${ms.toFixed(1)} ms` : `${ms.toFixed(0)} ms`);
const percentOf = (error) => `${Number((100 * error).toPrecision(2))} %`;

const draw = drawn(element("chart"), [0.68, 0.95], (context, width, height) => {
  const box = { left: 76, top: 44, width: width - 104, height: height - 108 };
  const across = { from: 3, to: 1e4, log: true, ticks: [[10, "10 ms"], [100, "100"], [1e3, "1 s"], [1e4, "10 s"]], name: "time of the run" };
  const up = { from: LOW, to: HIGH, log: true, ticks: [[1, "100 %"], [0.1, "10 %"], [0.01, "1 %"], [1e-3, "0.1 %"], [1e-4, "0.01 %"]], name: "error" };
  const place = axes(context, box, across, up), at = ({ ms, error }) => [place.x(Math.min(1e4, Math.max(3, ms))), place.y(Math.min(HIGH, error))];
  context.lineWidth = 2;
  context.setLineDash([8, 5]);
  context.strokeStyle = colours.text;
  line(context, [[box.left, place.y(0.01)], [box.left + box.width, place.y(0.01)]]);
  context.setLineDash([]);
  context.strokeStyle = colours.soft;
  line(context, front().map(at));
  for (const dot of dots) mark(context, dot.name, ...at(dot), dot === dots[dots.length - 1] ? 10 : 7.5);
  if (!dots.length && truth) {
    context.textAlign = "center";
    context.font = "17px system-ui, sans-serif";
    context.fillText("Each run leaves a dot here.", box.left + box.width / 2, box.top + box.height / 2 + 40);
  }
});

// A mark of a method: its form tells it without its colour.
function mark(context, name, x, y, r) {
  context.fillStyle = colours[METHODS[name].colour];
  context.strokeStyle = colours.card;
  context.lineWidth = 1.5;
  context.beginPath();
  if (name === "mean") context.arc(x, y, r, 0, 7);
  else if (name === "explicit") context.rect(x - 0.85 * r, y - 0.85 * r, 1.7 * r, 1.7 * r);
  else [[0, -1.2], [1.1, 0.8], [-1.1, 0.8]].forEach(([a, b], k) => (k ? context.lineTo(x + a * r, y + b * r) : context.moveTo(x + a * r, y + b * r)));
  context.closePath();
  context.fill();
  context.stroke();
}

const setStep = slider("step", (value) => `${((1e9 * data.until) / METHODS[method].steps[value]).toFixed(0)} ns`, () => {});
const choose = (name) => {
  method = name;
  remember({ method });
  setStep(element("step").value);
};
for (const [name, { words, colour }] of Object.entries(METHODS)) {
  const label = document.createElement("label"), input = document.createElement("input"), form = document.createElement("span");
  label.className = "switch";
  Object.assign(input, { type: "radio", name: "method", checked: name === method });
  input.addEventListener("change", () => choose(name));
  Object.assign(form, { textContent: { explicit: "■", mean: "●", last: "▲" }[name] });
  form.style.color = `var(--${colour})`;
  label.append(input, form, words);
  element("methods").append(label);
}
element("run").addEventListener("click", () => enqueue(method, +element("step").value));
const fill = () => {
  remember({ fill: 1 });
  for (const name of Object.keys(METHODS)) for (const number of [0, 3, 6, 8]) enqueue(name, number);
};
element("fill").addEventListener("click", fill);
ask(Object.fromEntries(Object.entries(METHODS).map(([name, { words }]) => [name, words])), show);
choose(method);
queue.push({ run: running(0.5, data.steps.true, 1, { tolerance: 1e-6, sweeps: [2, 100] }), then: ({ way }) => (truth = way) });
work();
if (address.get("fill")) fill();
