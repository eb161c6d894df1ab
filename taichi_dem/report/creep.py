"""Bodies that creep in contact under a steady load, which real friction would hold.

Friction without springs is a drag up to Coulomb's limit: below it, bodies slide as fast as the drag
lets them, on a slope that is flatter than the friction angle too. Such a contact is told from a
collision by its time, and by what the drag has given: what is pressed together parts within damping
over stiffness, and two pieces stop once the drag gave the momentum that they slide with. Pieces
that slide on as fast after many times as much are pushed by a load.
"""

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.report.readings import Kept, Run

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


class Creep(Kept):
    """Follows pairs of bodies that slide below the limit of friction, at recording times.

    speed: largest of a creep so far [m/s]. share: of its limit that friction took then.
    """

    kept = "time_s", "speed", "share", "code", "table"

    def __init__(self, run: Run):
        self.run, self.time_s, self.speed, self.share = run, 0.0, 0.0, 0.0
        self.code, self.table = np.zeros(0, dtype=np.int64), np.zeros((0, 9))
        law, model = run.model.contact, run.model
        self.softest, self.parting_s = np.inf, 0.0
        if law is not None:
            of_contacts, area = model.materials.of_contacts, law.areas(model.mesh)
            stiffness, damping = (of_contacts(name) * area for name in law.constants)
            self.softest = float(np.min(stiffness))
            self.parting_s = float(np.max(damping)) / self.softest

    def sample(self, time_s: float) -> np.ndarray:
        """Bodies that creep at a recording time [s]."""
        count = self.run.model.body_count
        force, bound, power = self.run.readings.contacts_now()[:, 14:17].T
        bodies = self.run.contacts.store.near_bodies()
        slides = (force > 0.0) & (force < _HELD * bound)
        bodies, force, bound = bodies[slides], force[slides], bound[slides]
        place = values(self.run.state.position, slice(count))
        offset, speed = place[bodies[:, 1]] - place[bodies[:, 0]], power[slides] / force
        code, rest = bodies[:, 0].astype(np.int64) * count + bodies[:, 1], np.zeros_like(force)
        table = np.column_stack([force, speed, rest, rest, speed, rest + time_s, offset])
        self._go_on(code, table, time_s - self.time_s)
        self.code, self.table, self.time_s = code, table, time_s
        lasts = time_s - table[:, _SINCE] > _PUSHED * self.parting_s
        places = np.flatnonzero(lasts & _goes_far(table, offset, bound / self.softest))
        if len(places):
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
        model = self.run.model
        piece = model.pieces(self.run.state.broken())
        mass = np.bincount(piece, model.body_mass, minlength=model.body_count)
        ends = np.sort(piece[bodies], axis=1)
        _, group = np.unique(ends, axis=0, return_inverse=True)
        group = group.reshape(-1)  # NumPy 2.0 returns a column
        impulse = np.bincount(group, table[:, _IMPULSE])[group]
        fastest = np.zeros(group.max() + 1)
        np.maximum.at(fastest, group, table[:, _FASTEST])
        lighter = mass[ends].min(axis=1)
        return (ends[:, 0] != ends[:, 1]) & (impulse > _PUSHED * lighter * fastest[group])

    def words(self) -> str:
        """The finding in words."""
        return (
            f"bodies in contact creep under a steady load, at up to {1e3 * self.speed:.2g} mm/s, "
            f"though it takes {100.0 * self.share:.2g} % of the friction that would hold them"
        )


def _goes_far(table, offset, least):
    """Whether pairs have moved as far as they have slid, and farther than a spring would let them.

    least: way at which a spring as stiff as the contact would slip [m], (n,).
    """
    way = table[:, _WAY]
    moved = np.linalg.norm(offset - table[:, _OFFSET:], axis=1)
    return (way > least) & (_ALIKE * moved > way) & (moved < _ALIKE * way)
