"""Why a box of grains damps: one box on its spring, shaken at several frequencies at once.

The grains are those of the automaton with static contact. Everything here runs on the engine's
thread.
"""

import math
from dataclasses import dataclass

import numpy as np

from _engine import engine
from ca_damper import Automaton, Batch, Oscillator, SceneTable
from ca_damper.record import Frame

#: Frequencies by the natural one of the empty box, and the cycles before and while measuring.
RATIOS = (0.88, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.99, 1.0, 1.02, 1.05)
TRANSIENT, MEASURED = 60, 15
#: Grains, their share of the box's mass, and the base's amplitude [m] at the beginning.
FIRST = {"grains": 30, "share": 0.07, "base": 0.6e-3, "ratio": 0.97}
#: Pictures of one cycle.
PICTURES = 4
FILLING = Automaton()


@dataclass(frozen=True, eq=False)
class Answer:
    """What one choice gives.

    grains, share (of their mass in the box's), ratio: the choice. oscillator: the box and its
    spring. rms: of the box at all RATIOS [m]. place: of the chosen ratio in RATIOS. amplitude: of
    the box there [m]. energy: J a cycle that "base" gives and that "dashpot" and "grains" take.
    damping_ratio: there, of dashpot and grains together. frames: of one cycle.
    """

    grains: int
    share: float
    ratio: float
    oscillator: Oscillator
    rms: np.ndarray
    place: int
    amplitude: float
    energy: dict
    damping_ratio: float
    frames: tuple

    @property
    def frequency(self):
        """Of the base [Hz]."""
        return self.ratio * self.oscillator.natural_frequency

    @property
    def throw(self):
        """Largest acceleration of the box by that of gravity: above 1 it throws its grains."""
        return (2.0 * math.pi * self.frequency) ** 2 * self.amplitude / FILLING.gravity

    def without(self, added=0.0):
        """RMS of the box with a fixed mass [kg] in place of the grains: (fine ratios, [m])."""
        fine = np.linspace(RATIOS[0], RATIOS[-1], 300)
        o = self.oscillator
        response = np.abs(o.transfer(fine * o.natural_frequency, added))
        return fine, o.base_amplitude * response / math.sqrt(2.0)


def structure(grains, share, base):
    """The box and spring for a share of mass: the paper's frequency and damping ratio are kept.

    Only ratios matter to how grains and box move, so the box is made heavier and not the grains
    lighter.
    """
    paper = Oscillator()
    mass = grains * FILLING.particle_mass / share
    scale = mass / paper.mass
    return Oscillator(mass, scale * paper.stiffness, scale * paper.damping, base)


def batch():
    """The compiled batch, a scene a ratio, made when it is first asked for."""

    def make():
        frequency = np.array(RATIOS) * Oscillator().natural_frequency
        table = SceneTable(FIRST["grains"], 1, FILLING.default_dt, frequency)
        return Batch(FILLING, table, measured_cycles=MEASURED)

    return engine.kept("box", make)


def answer(grains, share, base, ratio):
    """The Answer to a choice: grains, their share of the box's mass, base [m], ratio of RATIOS."""
    o = structure(grains, share, base)
    cycles, frames = engine.kept((grains, share, base), lambda: shaken(grains, o))
    place = RATIOS.index(ratio)
    return Answer(
        grains=grains,
        share=share,
        ratio=ratio,
        oscillator=o,
        rms=cycles.rms,
        place=place,
        amplitude=float(cycles.amplitude[place]),
        energy={name: float(value[place]) for name, value in energies(cycles, o).items()},
        damping_ratio=float(cycles.damping_ratio(o.mass, o.stiffness, o.damping)[place]),
        frames=frames[place],
    )


def shaken(grains, o):
    """Shake until all is as it will stay; returns Cycles at all RATIOS, and Frames of each."""
    made = batch()
    numbers = {"mass": o.mass, "stiffness": o.stiffness, "damping": o.damping}
    made.change(particles=grains, base_amplitude=o.base_amplitude, **numbers)
    made.start("rigid")
    made.run(TRANSIENT, 0)
    frames = one_cycle(made)
    return made.run(0, MEASURED), frames


def one_cycle(made):
    """Go on by a cycle; returns Frames at PICTURES even parts of it, a tuple for each scene."""
    marks = [made.steps_per_cycle * k // PICTURES for k in range(PICTURES + 1)]
    shots = []
    for here, there in zip(marks, marks[1:]):
        shots.append(frames_now(made))
        made.advance(there - here)
    return tuple(zip(*shots))


def frames_now(made):
    """A Frame of each scene as it is."""
    present = [made.sample()[name].tolist() for name in ("time_s", "x", "y")]
    seen = [made.snapshot(s) for s in range(made.count)]
    return [
        Frame(*numbers, shot["position"], shot["velocity"])
        for *numbers, shot in zip(*present, seen)
    ]


def energies(cycles, o):
    """Energy a cycle by where it comes from and goes to [J], arrays (scenes,); first harmonics.

    The base moves as y = -i y0 and pulls the box with K (y - x) + C (y' - x').
    """
    base = -1j * o.base_amplitude * np.ones(len(cycles.omega))
    stretch, speed = base - cycles.harmonic("x"), 1j * cycles.omega * base
    drag = speed - cycles.harmonic("v")
    pull = o.stiffness * stretch + o.damping * drag
    power = {
        "base": 0.5 * (pull * np.conj(speed)).real,
        "dashpot": 0.5 * o.damping * np.abs(drag) ** 2,
        "grains": cycles.complex_power.real,
    }
    return {name: value / cycles.frequency for name, value in power.items()}
