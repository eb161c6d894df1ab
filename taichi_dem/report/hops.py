"""Bodies that hop: they touch again and again, and slide on though friction could hold them."""

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.report.readings import Kept, Run

#: Touches from which on a pair may hop, a power of two.
_TOUCHES = 16
#: Share of its limit that friction takes of a body that slides.
_SLIDES = 0.95
#: Ratio of two speeds up to which they are about equal, and least cosine between their ways.
_ALIKE, _ALIGNED = 2.0, 0.9
#: Ways at which a spring as stiff as the contact would slip, from which on a pair has slid.
_FAR = 10.0
#: What is known of a pair: whether it touches, how often it began to, sums of friction and of its
#: limit [N]; time [s] and place of the second body from the first [m] at its first touch, and at
#: the last one whose number is a power of two.
_NOW, _COUNT, _RUB, _BOUND, _FIRST, _MARK, _COLUMNS = 0, 1, 2, 3, slice(4, 8), slice(8, 12), 12


class Hops(Kept):
    """Follows near pairs at recording times; those that bounce out of the list are forgotten.

    hops: bodies that have hopped, truth values, (body_count,). worst: of the fastest pair its
    touches, bodies, time of the first touch [s], speed [m/s] and share of the limit of friction.
    """

    kept = "code", "table", "hops", "worst"
    grows = "code", "table"

    def __init__(self, run: Run):
        self.run, self.code, self.table = run, np.zeros(0, dtype=np.int64), np.zeros((0, _COLUMNS))
        self.hops, self.worst = np.zeros(run.model.body_count, dtype=bool), np.zeros(6)
        law = run.model.contact
        self.follows = law is not None and bool(run.model.by_role["friction"])
        if self.follows:
            self.softest = float(np.min(law.strongest(run.model.mesh, run.model.materials)[0]))

    def sample(self, time_s: float) -> None:
        """Count the pairs that touch anew at a recording time [s]."""
        if not self.follows:
            return
        bodies, count = self.run.contacts.store.near_table()[0], self.run.model.body_count
        contacts = self.run.readings.contacts_now()
        place = values(self.run.state.position, slice(count))
        offset = place[bodies[:, 1]] - place[bodies[:, 0]]
        here = np.column_stack([np.full(len(bodies), time_s), offset])
        code = bodies[:, 0].astype(np.int64) * count + bodies[:, 1]
        table = np.zeros((len(here), _COLUMNS))
        _, now, then = np.intersect1d(code, self.code, assume_unique=True, return_indices=True)
        table[now] = self.table[then]
        touches = (contacts["on_second"][:, :3] != 0.0).any(axis=1)
        begins = touches & (table[:, _NOW] == 0.0)
        table[:, _NOW], table[:, _COUNT] = touches, table[:, _COUNT] + begins
        table[:, _RUB] += contacts["rub"]
        table[:, _BOUND] += contacts["bound"]
        self._compare(bodies, table, here, begins)
        self.code, self.table = code, table

    def _compare(self, bodies, table, here, begins):
        """Compare the ways of pairs since the marks, where the number of a touch is one."""
        number = table[:, _COUNT].astype(np.int64)
        first = begins & (number == 1)
        table[first, _FIRST] = here[first]
        marks = np.flatnonzero(begins & (number & (number - 1) == 0))
        late = marks[number[marks] >= _TOUCHES]
        late = late[_slides_on(table[late], here[late], self.softest)]
        self.hops[bodies[late]] = True
        since, mark = table[late, _FIRST], table[late, _MARK]
        speed = np.linalg.norm((here[late] - mark)[:, 1:], axis=1) / (here[late] - mark)[:, 0]
        if len(late) and speed.max() > self.worst[4]:
            k = int(speed.argmax())
            share = table[late[k], _RUB] / table[late[k], _BOUND]
            self.worst = np.array([number[late[k]], *bodies[late[k]], since[k, 0], speed[k], share])
        table[marks, _MARK] = here[marks]

    def findings(self) -> tuple[str, ...]:
        """A sentence about bodies that hop; or none."""
        touches, first, second, since, speed, share = self.worst.tolist()
        if not touches:
            return ()
        return (
            f"{self.hops.sum()} bodies hop: body {second:.0f} has left body {first:.0f} and "
            f"touched it again {touches - 1:.0f} times since t = {since:.4g} s, and slides on at "
            f"{1e3 * speed:.2g} mm/s, although {100.0 * share:.2g} % of their friction would hold "
            f"it; unless a load shakes them, {self.run.model.contact.calmer} ends this",
        )


def _slides_on(table, here, softest):
    """Whether pairs have slid on since their marks as they did before, (n,) truth values."""
    before, after = table[:, _MARK] - table[:, _FIRST], here - table[:, _MARK]
    travelled, ahead = (np.linalg.norm(each[:, 1:], axis=1) for each in (before, after))
    # Speeds times the product of both times.
    earlier, later = travelled * after[:, 0], ahead * before[:, 0]
    steady = (_ALIKE * later > earlier) & (later < _ALIKE * earlier)
    aligned = (before[:, 1:] * after[:, 1:]).sum(axis=1) > _ALIGNED * travelled * ahead
    held = table[:, _RUB] < _SLIDES * table[:, _BOUND]
    # Not more often does a pair begin to touch than it is found touching.
    far = ahead * softest * table[:, _COUNT] > _FAR * table[:, _BOUND]
    return steady & aligned & held & far
