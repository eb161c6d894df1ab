"""Bodies that creep in contact under a steady load, which real friction would hold.

Friction without springs is a drag up to Coulomb's limit: below it, bodies slide as fast as the drag
lets them, on a slope that is flatter than the friction angle too. Such a contact is told from a
collision by its time, and by what the drag has given: what is pressed together parts within damping
over stiffness, and two pieces stop once the drag gave the momentum that they slide with. Pieces
that slide on as fast after many times as much are pushed by a load.
"""

from collections.abc import Mapping

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.mesh.tetrahedra import components
from taichi_dem.report.readings import Readings
from taichi_dem.state.model import Model
from taichi_dem.state.state import State

#: Share of its limit below which friction would hold; a contact near it may slide next.
_HELD = 0.98
#: Impulse of the drag over the momentum of the sliding, and time of the sliding over that of a
#: collision, from which on a load must push.
_PUSHED = 10.0
#: Ratio of two speeds, or of two lengths, up to which they are about equal.
_ALIKE = 2.0
#: What is known of a pair: friction [N], speed [m/s], impulse [N s] and way [m] since it began to
#: slide, largest speed, when it began [s], and where the second body was then from the first [m].
_FORCE, _SPEED, _IMPULSE, _WAY, _FASTEST, _SINCE, _OFFSET = range(7)


class Creep:
    """Follows pairs of bodies that slide below the limit of friction, at recording times.

    speed: largest of a creep so far [m/s]. share: of its limit that friction took then.
    """

    def __init__(self, model: Model, state: State, readings: Readings):
        self.model, self.state, self.readings = model, state, readings
        self.time_s, self.speed, self.share = 0.0, 0.0, 0.0
        self.code, self.table = np.zeros(0, dtype=np.int64), np.zeros((0, 9))
        self._pieces: tuple[int, np.ndarray] = (-1, np.zeros(0, dtype=np.int64))
        stiffness, damping = (
            model.materials.of_contacts(f"contact_{name}") for name in ("stiffness", "damping")
        )
        self.softest = float(np.min(stiffness))
        self.parting_s = float(np.max(damping)) / self.softest

    def sample(self, time_s: float) -> np.ndarray:
        """Bodies that creep at a recording time [s]."""
        bodies, (force, bound, power) = self.readings.rubbing()
        slides = (force > 0.0) & (force < _HELD * bound)
        bodies, force, bound = bodies[slides], force[slides], bound[slides]
        place = values(self.state.position, slice(self.model.body_count))
        offset, speed = place[bodies[:, 1]] - place[bodies[:, 0]], power[slides] / force
        code = bodies[:, 0].astype(np.int64) * self.model.body_count + bodies[:, 1]
        rest = np.zeros_like(force)
        table = np.column_stack([force, speed, rest, rest, speed, rest + time_s, offset])
        self._go_on(code, table, time_s - self.time_s)
        self.code, self.table, self.time_s = code, table, time_s
        lasts = time_s - table[:, _SINCE] > _PUSHED * self.parting_s
        places = np.flatnonzero(lasts & _goes_far(table, offset, bound / self.softest))
        places = places[self._is_pushed(bodies[places], table[places])]
        if len(places):
            self.speed = max(self.speed, float(speed[places].max()))
            self.share = float(force[places].sum() / bound[places].sum())
        return np.unique(bodies[places])

    def _go_on(self, code, table, elapsed):
        """Add what pairs have done since the last look, where they slide on as fast as before."""
        _, now, then = np.intersect1d(code, self.code, assume_unique=True, return_indices=True)
        before, after = self.table[then], table[now]
        fastest = np.maximum(before[:, _FASTEST], after[:, _SPEED])
        steady = _ALIKE * after[:, _SPEED] >= fastest
        now, before, after = now[steady], before[steady], after[steady]
        mean = 0.5 * elapsed * (before[:, :2] + after[:, :2])
        table[now, _IMPULSE : _WAY + 1] = before[:, _IMPULSE : _WAY + 1] + mean
        table[now, _FASTEST] = fastest[steady]
        table[now, _SINCE:] = before[:, _SINCE:]

    def _is_pushed(self, bodies, table):
        """Whether the drag between two pieces would have stopped them many times over."""
        if not len(bodies):
            return np.zeros(0, dtype=bool)
        piece = self._piece_of_body()
        mass = np.bincount(piece, self.model.body_mass, minlength=self.model.body_count)
        ends = np.sort(piece[bodies], axis=1)
        _, group = np.unique(ends, axis=0, return_inverse=True)
        group = group.reshape(-1)  # NumPy 2.0 returns a column
        impulse = np.bincount(group, table[:, _IMPULSE])[group]
        fastest = np.zeros(group.max() + 1)
        np.maximum.at(fastest, group, table[:, _FASTEST])
        lighter = mass[ends].min(axis=1)
        return (ends[:, 0] != ends[:, 1]) & (impulse > _PUSHED * lighter * fastest[group])

    def _piece_of_body(self):
        """Piece of each body, which intact bonds hold together, (body_count,)."""
        top = self.model.topology
        intact = ~self.state.broken()
        if self._pieces[0] != intact.sum():
            ends = np.column_stack([top.master, top.slave])[intact]
            self._pieces = int(intact.sum()), components(self.model.body_count, ends)
        return self._pieces[1]

    def words(self) -> str:
        """The finding in words."""
        return (
            f"bodies in contact creep under a steady load, at up to {1e3 * self.speed:.2g} mm/s, "
            f"though it takes {100.0 * self.share:.2g} % of the friction that would hold them"
        )

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        return {
            "creep": np.array([self.time_s, self.speed, self.share]),
            "creep_pairs": np.column_stack([self.code, self.table]),
        }

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        self.time_s, self.speed, self.share = saved["creep"].tolist()
        self.code = saved["creep_pairs"][:, 0].astype(np.int64)
        self.table = saved["creep_pairs"][:, 1:].copy()


def _goes_far(table, offset, least):
    """Whether pairs have moved as far as they have slid, and farther than a spring would let them.

    least: way at which a spring as stiff as the contact would slip [m], (n,).
    """
    way = table[:, _WAY]
    moved = np.linalg.norm(offset - table[:, _OFFSET:], axis=1)
    return (way > least) & (_ALIKE * moved > way) & (moved < _ALIKE * way)
