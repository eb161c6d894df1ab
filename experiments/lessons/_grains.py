"""Why a box of grains damps: one box on its spring, shaken at several frequencies at once.

The grains are those of the automaton by rules of place. All runs on the thread of the session.
"""

import numpy as np

from _page import percent
from ca_damper import Automaton, Batch, Oscillator, SceneTable
from ca_damper.plot.boxes import Box, DrawnBox, frame_panel
from ca_damper.report.record import frames_of
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, STYLES
from taichi_dem.kit.session_thread import session

#: Frequencies by the natural one of the empty box, and the cycles before and while measuring.
RATIOS = (0.88, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.99, 1.0, 1.02, 1.05)
TRANSIENT, MEASURED = 60, 15
PAGE, WAIT = "why_a_box_of_grains_damps", "Shaking."
ALT = "Response, free decay, energy a cycle, box"
SIZE, TALL = (11.0, 5.8), (4.4, 14.0)
#: Height from which the box is let go [m], and the cycles of its decay.
DROP, DECAY = 30e-3, 24
CONTROLS = {
    "base": ((0.05, 0.1, 0.2, 0.4, 0.6, 1.0, 1.5, 2.0), 0.6, "base moves by [mm]"),
    "ratio": (RATIOS, 0.97, "frequency / own frequency"),
    "grains": ((5, 10, 20, 30, 40, 60), 30, "grains (160 fill the box)"),
    "share": ((2, 4, 7, 10, 15, 20), 7, "their mass [% of the box's]"),
}
#: Pictures of one cycle.
PICTURES = 4
FILLING, PAPER = Automaton(), Oscillator()


class Answer:
    """Motion and energies for one choice: grains, their share of the box's mass, base [m], ratio.

    oscillator: the box and its spring. cycles: measured, at all RATIOS; the rest is at the chosen
    one. frames: of one cycle. omega: of the base [rad/s]. swing: amplitude of the box [m]. throw:
    its largest acceleration by that of gravity, above 1 it throws its grains. energy: J a cycle
    that "base" gives and that "dashpot" and "filling" take, first harmonics. damping_ratio: of
    dashpot and grains together. decay: amplitude [m] of each cycle of a box that is let go.
    """

    def __init__(self, grains, share, base, ratio):
        self.grains, self.share, self.ratio = grains, share, ratio
        o = self.oscillator = structure(grains, share, base)
        self.cycles, frames = shaken(grains, o)
        self.frames = frames[RATIOS.index(ratio)]
        powers = self.cycles.powers(o.base_amplitude, o.stiffness, o.damping)
        self.energy = {k: self.at_ratio(v / self.cycles.frequency) for k, v in powers.items()}
        damping_ratio = self.cycles.damping_ratio(o.mass, o.stiffness, o.damping)
        values = damping_ratio, self.cycles.amplitude, self.cycles.omega
        self.damping_ratio, self.swing, self.omega = map(self.at_ratio, values)
        self.throw = self.omega**2 * self.swing / FILLING.gravity
        self.decay = let_go(grains, o)

    def at_ratio(self, values):
        """The chosen one of values at all RATIOS."""
        return float(values[RATIOS.index(self.ratio)])


def answer(base, ratio, grains, share):
    """The Answer to a choice of the CONTROLS."""
    return session.remember(Answer)(grains, 0.01 * share, 1e-3 * base, ratio)


def words(answer):
    """The swing, and what the grains take, in sentences."""
    taken = percent(max(0.0, answer.energy["filling"] / answer.energy["base"]))
    return (
        f"The box swings by **{1e3 * answer.swing:.2g} mm** and is accelerated by up to "
        f"**{answer.throw:.2g} g**. The grains take **{taken}** of the energy that the base gives; "
        f"the damping ratio is {answer.damping_ratio:.2g} instead of "
        f"{answer.oscillator.damping_ratio:.2g}."
    )


def structure(grains, share, base):
    """The box and spring for a share of mass: the paper's frequency and damping ratio are kept.

    Only ratios matter to how grains and box move, so the box is made heavier and not the grains
    lighter.
    """
    return PAPER.scaled(grains * FILLING.particle_mass / share, base)


@session.remember
def compiled():
    """The batch, a scene a ratio."""
    frequency = np.array(RATIOS) * PAPER.natural_frequency
    table = SceneTable(CONTROLS["grains"][1], 1, FILLING.default_dt, frequency)
    return Batch(FILLING, table, measured_cycles=MEASURED)


@session.remember
def shaken(grains, o):
    """Shake until all is as it will stay; returns Cycles at all RATIOS, and Frames of each."""
    batch = compiled()
    numbers = {"mass": o.mass, "stiffness": o.stiffness, "damping": o.damping}
    batch.change(particles=grains, base_amplitude=o.base_amplitude, **numbers)
    batch.start("rigid")
    batch.run(TRANSIENT, 0)
    marks, shots = [batch.steps_per_cycle * k // PICTURES for k in range(PICTURES + 1)], []
    for steps in np.diff(marks, axis=0):
        shots.append(frames_of(batch))
        batch.advance(steps)
    return batch.run(0, MEASURED), tuple(zip(*shots))


@session.remember
def let_go(grains, o):
    """Amplitude of each cycle [m] of a box that is let go from DROP on a base at rest."""
    table = SceneTable(grains, 1, FILLING.default_dt, o.natural_frequency, 0.0)
    batch = Batch(FILLING, table, measured_cycles=DECAY)
    numbers = {"mass": o.mass, "stiffness": o.stiffness, "damping": o.damping}
    batch.change(**numbers)
    batch.start(displacement=DROP)
    return np.sqrt(2.0) * batch.run(0, DECAY).rms_by_cycle[0]


def draw(figure, answer, tall):
    """Response, free decay, energy a cycle, and the box through one cycle."""
    above, below = figure.add_gridspec(2, 1, height_ratios=(1.5 if tall else 1.0, 1.15))
    grid = (3, 1) if tall else (1, 3)
    made = above.subgridspec(*grid, width_ratios=(1.6, 1.2, 1.1)[: grid[1]]).subplots()
    for axes, one in zip(made, (_response, _decay, _energy)):
        one(axes, answer)
    rows = 2 if tall else 1
    _boxes(figure, below.subgridspec(rows, PICTURES // rows).subplots().ravel(), answer)


def _response(axes, answer):
    """RMS of the box over frequency, with grains, empty, and with the grains glued to it."""
    fine, o = np.linspace(RATIOS[0], RATIOS[-1], 300), answer.oscillator
    glued = answer.share * o.mass, "--", "grains glued to the floor"
    for mass, line, label in ((0.0, ":", STYLES["empty"].label), glued):
        rms = 1e3 * o.rms(fine * o.natural_frequency, mass)
        axes.plot(fine, rms, color=GREY, ls=line, lw=1.2, label=label)
    rms, look = 1e3 * answer.cycles.rms, {"color": STYLES[FILLING.label].colour, "ms": 4}
    axes.plot(RATIOS, rms, "o-", label=f"{answer.grains} grains", **look)
    axes.plot(answer.ratio, answer.at_ratio(rms), "o", ms=12, mfc="none", mec=BLACK, mew=1.5)
    axes.set(xlabel="frequency / own frequency of the empty box [1]", ylim=(0.0, None))
    axes.set(ylabel="RMS displacement [mm]", title="how far the box swings")
    # Room for the legend above the curves.
    axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])
    axes.legend(loc="upper left")


def _decay(axes, answer):
    """Amplitude over cycles after the box is let go, with free grains and with glued ones."""
    o, cycles = answer.oscillator, np.arange(DECAY) + 0.5
    heavy = o.mass * (1.0 + answer.share)
    lost = 0.5 * o.damping / heavy / o.natural_frequency
    axes.plot(cycles, 1e3 * DROP * np.exp(-lost * cycles), color=GREY, ls="--", lw=1.2)
    look = {"color": STYLES[FILLING.label].colour, "ms": 4}
    axes.plot(cycles, 1e3 * answer.decay, "o-", **look)
    axes.axhline(1e3 * FILLING.gravity * o.mass / o.stiffness, color=BLACK, ls=":", lw=1.0)
    axes.text(DECAY, 1e3 * FILLING.gravity * o.mass / o.stiffness, "1 g", ha="right", va="bottom")
    axes.set(xlabel="cycles [1]", ylabel="amplitude [mm]", ylim=(0.0, 1.05e3 * DROP))
    axes.set_title("let go, nothing shakes")


def _energy(axes, answer):
    shown = {"base\ngives": GREEN, "dashpot\ntakes": GREY, "grains\ntake": BLUE}
    values = [1e3 * value for value in answer.energy.values()]
    bars = axes.bar(list(shown), values, color=list(shown.values()))
    axes.bar_label(bars, fmt="%.3g", fontsize=8.5)
    axes.set(ylabel="energy a cycle [mJ]", title=f"at {answer.ratio:g} × own frequency")
    axes.margins(y=0.15)
    axes.axhline(0.0, color=BLACK, lw=0.8)
    axes.grid(False, axis="x")


def _boxes(figure, panels, answer):
    """The box at even parts of a cycle."""
    box = Box.of(FILLING)
    swing = max(0.5 * box.diameter, *(abs(frame.x) for frame in answer.frames))
    for k, (axes, frame) in enumerate(zip(panels, answer.frames)):
        frame_panel(axes, box, swing)
        drawn = DrawnBox(axes, box, max(0.05, answer.omega * answer.swing))
        drawn.show(frame)
        axes.set_title(f"{k}/{PICTURES} of a cycle", loc="center")
    words = "grains: blue rise, red fall [m/s]"
    figure.colorbar(drawn.particles, ax=panels, label=words, aspect=18, pad=0.01)
