"""Numbers of the scenes of a batch, checked against its filling, with steps that fit the cycle."""

from collections.abc import Sequence

import numpy as np

from ca_damper.oscillator import Oscillator
from ca_damper.scenes.clock import steps_per_cycle
from ca_damper.scenes.gravity import gravity_along
from ca_damper.scenes.table import SceneTable

_STRUCTURE = ("mass", "stiffness", "damping", "base_amplitude")


class SceneNumbers:
    """A table whose steps are shortened so that a whole number of them makes a cycle."""

    def __init__(self, fillings: object, table: SceneTable, has_box: np.ndarray):
        self.fillings, self.table = fillings, table.copy()
        self.has_box = has_box
        self.largest_dt = self.table.column("dt")
        self.drive(self.table.column("frequency"))

    def drive(self, frequency: np.ndarray) -> None:
        """Take other frequencies [Hz], (scenes,), and fit the steps to the cycles."""
        asked = zip(frequency, self.largest_dt)
        steps = np.array([steps_per_cycle(float(f), float(dt)) for f, dt in asked], np.int32)
        dt = 1.0 / (frequency * steps)
        columns = self.fillings.which, self.table.column("particles"), dt
        boxed = (column[self.has_box].tolist() for column in columns)
        for k, particles, step in sorted(set(zip(*boxed))):
            self.fillings.kinds[k].check(particles, step)
        self.table.drive(frequency, dt)
        self.steps_per_cycle = steps

    def pace(self) -> np.ndarray:
        """Frequencies [Hz] and steps [s], (2, scenes)."""
        return np.stack([self.table.column(name) for name in ("frequency", "dt")])

    def take_pace(self, pace: Sequence[np.ndarray], steps: np.ndarray) -> None:
        """Restore the arrays of ``pace``, with the steps of a cycle."""
        self.table.drive(*pace)
        self.steps_per_cycle = steps

    def initial(self, start: str) -> np.ndarray:
        """(x, v) of the container at the beginning, (scenes, 2); start: one of checks.STARTS."""
        state = np.zeros((self.table.count, 2))
        if start == "rest":
            return state
        for s in range(self.table.count):
            row, filling = self.table.row(s), self.fillings.of(s)
            oscillator = Oscillator(**{name: row[name] for name in _STRUCTURE})
            fixed = row["particles"] * filling.particle_mass if start == "rigid" else 0.0
            state[s] = oscillator.steady_state(row["frequency"], fixed, gravity_along(filling))
        return state
