"""Why a box of grains damps: one box on its spring, shaken at several frequencies at once.

The grains are those of the automaton with static contact. All runs on the engine's thread.
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
#: Sliders of the page: steps, the first, label.
CHOICES = {
    "base": ((0.05, 0.1, 0.2, 0.4, 0.6, 1.0, 1.5, 2.0), 0.6, "base moves by [mm]"),
    "ratio": (RATIOS, 0.97, "frequency / own frequency"),
    "grains": ((5, 10, 20, 30, 40, 60), 30, "grains (160 fill the box)"),
    "share": ((2, 4, 7, 10, 15, 20), 7, "their mass [% of the box's]"),
}
#: Pictures of one cycle.
PICTURES = 4
FILLING = Automaton()


@dataclass(frozen=True, eq=False)
class Answer:
    """Motion and energies for one choice.

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


@engine.remember
def compiled():
    """The batch, a scene a ratio."""
    frequency = np.array(RATIOS) * Oscillator().natural_frequency
    table = SceneTable(CHOICES["grains"][1], 1, FILLING.default_dt, frequency)
    return Batch(FILLING, table, measured_cycles=MEASURED)


def answer_to(choice):
    """The Answer to the values of the sliders."""
    share, base = 0.01 * choice["share"], 1e-3 * choice["base"]
    return answer(choice["grains"], share, base, choice["ratio"])


def answer(grains, share, base, ratio):
    """The Answer to a choice: grains, their share of the box's mass, base [m], ratio of RATIOS."""
    place, o = RATIOS.index(ratio), structure(grains, share, base)
    cycles, frames = shaken(grains, o)
    return Answer(
        *(grains, share, ratio, o),
        rms=cycles.rms,
        place=place,
        amplitude=float(cycles.amplitude[place]),
        energy={name: float(value[place]) for name, value in energies(cycles, o).items()},
        damping_ratio=float(cycles.damping_ratio(o.mass, o.stiffness, o.damping)[place]),
        frames=frames[place],
    )


@engine.remember
def shaken(grains, o):
    """Shake until all is as it will stay; returns Cycles at all RATIOS, and Frames of each."""
    batch = compiled()
    numbers = {"mass": o.mass, "stiffness": o.stiffness, "damping": o.damping}
    batch.change(particles=grains, base_amplitude=o.base_amplitude, **numbers)
    batch.start("rigid")
    batch.run(TRANSIENT, 0)
    marks, shots = [batch.steps_per_cycle * k // PICTURES for k in range(PICTURES + 1)], []
    for steps in np.diff(marks, axis=0):
        present = batch.sample()
        shots.append([frame(batch, present, s) for s in range(batch.count)])
        batch.advance(steps)
    return batch.run(0, MEASURED), tuple(zip(*shots))


def frame(batch, present, s):
    """A Frame of a scene as it is."""
    shot = batch.snapshot(s)
    numbers = (float(present[name][s]) for name in ("time_s", "x", "y"))
    return Frame(*numbers, shot["position"], shot["velocity"])


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
