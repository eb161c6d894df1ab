const END = 1.2e-4, GUESSES = { lags: "rings a little late", grows: "gains energy from nowhere", same: "moves as before" };
const bars = ["explicit", "solved"].map((name) => ({ name, canvas: element(name), note: element(`${name}-note`), curve: [] }));
const view = { turn: turnOf(-28, 22), middle: data.middle, distance: 1.6 };
let share = 10 ** (+(address.get("step") || -15) / 200), time = 0;

function renew() {
  time = 0;
  for (const bar of bars) {
    bar.solid = solidOf(data, { dt: share * data.limit, theta: bar.name === "solved" ? 0.5 : 0, effects: { contact: false, friction: false, softening: false, slip: false } });
    bar.solid.strike(pushOf(bar.solid));
    bar.curve = [];
    bar.lost = false;
    note(bar);
  }
}

// Energy in the account over that given; a run that gains a million times as much has ended.
function note(bar) {
  const ratio = Object.values(bar.solid.energy()).reduce((sum, one) => sum + one, 0) / bar.solid.given;
  bar.lost = !(Math.abs(ratio) < 1e6);
  bar.ratio = bar.lost ? 1e6 : ratio;
  bar.curve.push([bar.solid.steps * bar.solid.dt, Math.max(0.5, bar.ratio)]);
  bar.note.textContent = bar.lost ? `stopped after ${bar.solid.steps} steps` : `${bar.solid.steps} steps of ${Math.round(1e9 * bar.solid.dt)} ns`;
}

function advance(bar) {
  if (bar.lost || bar.solid.steps * bar.solid.dt > time) return;
  while (!bar.lost && (bar.solid.steps + 1) * bar.solid.dt <= time) {
    bar.solid.step();
    if (bar.solid.steps % 4 === 0 || share > 3) note(bar);
  }
}

const play = animation(() => {
  time += END / 240;
  bars.forEach(advance);
  show();
  return time < END;
});

function show() {
  bars.forEach((bar) => bar.draw());
  account();
  const [explicit, solved] = bars;
  element("gain").textContent = explicit.lost ? "× 1,000,000" : `× ${explicit.ratio.toFixed(explicit.ratio < 10 ? 2 : 0)}`;
  element("gain-note").textContent = `in the explicit bar, × ${solved.ratio.toFixed(2)} in the solved one, of what the push gave.`;
  judge(share > 1.05 && explicit.ratio > 3 ? "grows" : null, "the account has energy that nothing gave.");
}

function fillOf(bar) {
  const { v } = bar.solid;
  return (i) => {
    if (i === data.worst || i === data.other) return colours.violet;
    const speed = Math.min(1, size3(v, 3 * i) / 0.6);
    return mixed(colours.body, bar.name === "explicit" ? colours.red : colours.blue, bar.lost ? 1 : speed);
  };
}

for (const bar of bars) {
  bar.draw = drawn(bar.canvas, [0.62, 0.72], (context, width, height) => {
    Object.assign(view, { scale: width * 2.05, x: width * 0.49, y: height * 0.5 });
    context.save();
    drawSolid(context, bar.solid, view, fillOf(bar), bar.lost ? 0 : 600);
    context.restore();
    if (bar.lost) stopped(context, width);
  });
}

function stopped(context, width) {
  context.font = "650 17px system-ui, sans-serif";
  context.fillStyle = colours.bad;
  context.textAlign = "center";
  context.fillText("stopped: energy from nowhere", width / 2, 26);
}

const account = drawn(element("account"), [0.34, 0.62], (context, width, height) => {
  const box = { left: 58, top: 30, width: width - 78, height: height - 84 };
  const ticks = [[1, "1"], [100, "100"], [1e4, "10⁴"], [1e6, "10⁶"]];
  const place = axes(context, box, { from: 0, to: 120, ticks: [0, 30, 60, 90, 120].map((t) => [t, `${t}`]), name: "time [µs]" }, { from: 0.5, to: 1e6, log: true, ticks, name: "energy / energy put in" });
  context.lineWidth = 3;
  for (const { name, curve } of bars) {
    context.setLineDash(name === "solved" ? [9, 5] : []);
    context.strokeStyle = name === "explicit" ? colours.red : colours.blue;
    line(context, curve.map(([t, e]) => [place.x(1e6 * Math.min(t, END)), place.y(e)]));
  }
  context.setLineDash([]);
});

const again = () => {
  renew();
  show();
  play();
};
const words = (value) => {
  const times = 10 ** (value / 200);
  return `${times.toFixed(times < 10 ? 2 : 0)} × the limit, ${Math.round(1e9 * times * data.limit)} ns`;
};
const setStep = slider("step", words, (value) => {
  share = 10 ** (value / 200);
  remember({ step: value });
  again();
});
setStep(Math.round(200 * Math.log10(share)));
element("again").addEventListener("click", again);
ask(GUESSES, show);
again();
// A link may lead to a time [µs].
if (address.get("at")) {
  time = Math.min(END, 1e-6 * +address.get("at"));
  bars.forEach(advance);
  show();
}
