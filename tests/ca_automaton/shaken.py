"""Automata in a container whose motion is prescribed, and what their particles do."""

import numpy as np

from taichi_dem.kit.allocation import assign
from tests.driven import Driven

#: Room for all tests of this folder, so that each structure is compiled once.
SCENES, TRACED = 64, 12500
_with_room = set()


class Shaken(Driven):
    """Scenes of one automaton in containers that move as x = A sin(w t), all at once."""

    def __init__(self, filling, particles, seed=1, dt=1e-4, amplitude=0.0, frequency=6.0, traced=0):
        one = filling[0] if isinstance(filling, list) else filling
        key = (type(one), one.structure.key)
        if key not in _with_room:
            _with_room.add(key)
            Driven(one, np.resize(particles, SCENES), 1, dt, 0.0, frequency, TRACED)
        super().__init__(filling, particles, seed, dt, amplitude, frequency, traced)

    @property
    def geometry(self):
        """Of the lattice."""
        return self.device.lattice.geometry(0)

    def state(self):
        """Kind, speed, way, and speed across, in all cells and the one beyond, to compare bits."""
        cells, count = self.device.cells, self.geometry.cells + 1
        fields = [cells.kind, cells.speed, cells.travelled]
        if hasattr(cells, "across"):
            fields.append(cells.across)
        return [self.in_use(field)[:, :count] for field in fields]

    def put(self, field, rows):
        """Write a field in the cells of all scenes."""
        whole = self.in_use(field)
        whole[:, : rows.shape[1]] = rows
        assign(field, whole)
