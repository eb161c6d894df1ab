"""Automata in a container whose motion is prescribed, and what their particles do."""

from taichi_dem.kit.allocation import assign
from tests.driven import Driven


class Shaken(Driven):
    """Scenes of one automaton in containers that move as x = A sin(w t), all at once."""

    def __init__(self, filling, particles, seed=1, dt=1e-4, amplitude=0.0, frequency=6.0, traced=0):
        super().__init__(filling, particles, seed, dt, amplitude, frequency, traced)

    @property
    def geometry(self):
        """Of the lattice."""
        return self.device.lattice.geometry

    def state(self):
        """Kind, speed and way in all cells and the one beyond, to compare bits."""
        cells, count = self.device.cells, self.geometry.cells + 1
        return [
            self.in_use(field)[:, :count] for field in (cells.kind, cells.speed, cells.travelled)
        ]

    def put(self, field, rows):
        """Write a field in the cells of all scenes."""
        whole = self.in_use(field)
        whole[:, : rows.shape[1]] = rows
        assign(field, whole)
