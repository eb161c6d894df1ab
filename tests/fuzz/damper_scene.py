"""A random scene of the damper: a filling, a table of few scenes, and how it is shaken."""

from typing import Any, NamedTuple

import numpy as np

from ca_damper import Automaton, Batch, Combined, RigidMass, SceneTable, Spheres
from ca_damper.plot import Box
from tests.fuzz.draws import Draws
from tests.fuzz.ends import OutOfTime, Wrong
from tests.paper import expected
from tests.rounding import momentum_rounding

#: Steps of a run: enough for grains to fall through the box, few enough to be short.
STEPS = 2000
#: Accountings by which some momentum never reaches the container.
LOSSY = ("landing", "landing+ejection")


class Kind(NamedTuple):
    """Structure that is compiled: filling, its words, and the mount."""

    filling: Any
    words: dict
    mount: str


KINDS = (
    Kind(Automaton, {"rules": "paper"}, "spring"),
    Kind(Automaton, {"rules": "paper", "accounting": "landing", "traversal": "scan"}, "base"),
    Kind(Automaton, {"rules": "place"}, "spring"),
    Kind(Spheres, {}, "spring"),
    Kind(Spheres, {"friction_law": "history", "rotation": True}, "base"),
    Kind(Spheres, {"damping": "printed", "search": "all_pairs"}, "floor"),
    Kind(Combined, {}, "spring"),
    Kind(RigidMass, {}, "base"),
)


class DamperScene:
    """Everything of a scene by its seed; what it draws depends on nothing else."""

    def __init__(self, seed, kind):
        self.draws, self.kind = Draws(seed), kind
        self.filling = self.table = None

    def build(self):
        """Draw all of it; raises what the package raises for what cannot be used."""
        draws = self.draws
        self.filling = self.kind.filling(**self.kind.words, **self.numbers())
        most = min(self.filling.capacity, 300)
        few = [draws.whole(0, most + draws.one_of(0, 0, 0, 1)) for _ in range(draws.one_of(1, 3))]
        structure = {} if draws.chance(0.5) else self.structure()
        self.table = SceneTable(
            few,
            draws.whole(0, 2**31 - 1),
            draws.near(self.filling.default_dt),
            draws.given(draws.power(0.0, 2.0)),
            draws.given(draws.power(-6.0, -1.5)),
            **structure,
        )

    def structure(self):
        """Numbers of the primary structure."""
        draws = self.draws
        return {
            "mass": draws.near(0.086),
            "stiffness": draws.near(123.4),
            "damping": draws.near(0.08, may_vanish=True),
        }

    def numbers(self):
        """Numbers of the filling."""
        draws, kind = self.draws, self.kind.filling
        drawn = {"particle_mass": draws.near(0.2e-3), "gravity": draws.near(9.8, may_vanish=True)}
        if kind is RigidMass:
            return drawn
        for name in ("restitution", "wall_restitution"):
            drawn[name] = draws.given(draws.one_of(0.0, 0.05, 0.5, 0.75, 0.99, 1.0))
        if kind is Automaton:
            cells = {"columns": draws.whole(1, 12), "rows": draws.whole(1, 16)}
            if self.kind.words.get("rules") == "place" and draws.chance(0.5):
                cells["friction"] = draws.near(0.5, may_vanish=True)
            return {**drawn, **cells, "width": draws.near(6e-3), "v_max": draws.near(5.0)}
        width = draws.near(6e-3)
        size = width if isinstance(width, float) and 0.0 < abs(width) < 1.0 else 6e-3
        for name in ("width", "height"):
            drawn[name] = draws.given(abs(size) * draws.rng.uniform(1.0, 15.0))
        for name in ("young", "wall_young"):
            drawn[name] = draws.near(0.5e9)
        for name in ("poisson", "wall_poisson"):
            drawn[name] = draws.given(draws.rng.uniform(-0.5, 0.5))
        for name in ("friction", "wall_friction"):
            drawn[name] = draws.near(0.5)
        return {**drawn, "diameter": width}

    def __str__(self):
        return f"{self.filling!r} on the {self.kind.mount}, {self.table!r}"


def run_damper(trial, seconds):
    """Run a ``DamperScene``; returns no warnings. Raises Wrong for wrong numbers."""
    trial.build()
    samples = moving(trial, trial.table, seconds)
    judge(trial, *samples)
    if trial.draws.chance(0.2) and trial.table.count > 1:
        # Whatever a scene does depends on its own row only.
        last = trial.table.count - 1
        alone = moving(trial, SceneTable(**trial.table.row(last)), seconds)
        if not _same(samples[1][last], alone[1][0]):
            raise Wrong("a scene has other bits alone than in a batch")
    return ()


def _same(first, second):
    return all(np.asarray(first[n]).tobytes() == np.asarray(second[n]).tobytes() for n in first)


def moving(trial, table, seconds):
    """Batch and snapshots of its scenes after a run from rest."""
    batch = Batch(trial.filling, table, mount=trial.kind.mount)
    with expected(batch):
        batch.start()
    watch = _Watch(seconds)
    if batch.steps_per_cycle.max() <= STEPS:
        cycles = batch.run(0, 1, watch)
        if not np.isfinite(cycles.record).all():
            raise Wrong("measures that are no finite numbers, without a word")
    else:
        batch.advance(STEPS, watch)
    return batch, [batch.snapshot(s) for s in range(table.count)]


class _Watch:
    """Listener of the progress that stops a run after some seconds."""

    def __init__(self, seconds):
        self.most = seconds

    def __call__(self, progress):
        """Raise OutOfTime when it is over."""
        if progress.seconds > self.most:
            raise OutOfTime


def judge(trial, batch, snapshots):
    """Raise Wrong for lost particles, numbers that are none, or momentum from nowhere."""
    filling, counts = trial.filling, batch.table.column("particles")
    for count, shot in zip(counts, snapshots):
        bad = [name for name, value in shot.items() if not np.isfinite(np.asarray(value)).all()]
        if bad:
            raise Wrong(f"no finite numbers without a word: {', '.join(bad)}")
        if trial.kind.filling is not RigidMass:
            kept_inside(filling, count, shot["position"])
    error = batch.report().momentum_error
    if getattr(filling, "accounting", "all") not in LOSSY and not error <= momentum_rounding(batch):
        raise Wrong(f"momentum error {error:.3g} of what was exchanged")


def kept_inside(filling, count, place):
    """Raise Wrong unless as many particles as there were lie in the box."""
    if len(place) != count:
        raise Wrong(f"{len(place)} particles of {count}")
    box = Box.of(filling)
    # In an automaton every other column stands half a cell higher, and one may be under way.
    slack = box.diameter * (1.0 if box.staggered else 0.5)
    top = np.array([box.width, box.height + 0.5 * slack])
    out = ~((place >= -slack) & (place <= top + slack)).all(axis=1)
    if out.any():
        raise Wrong(f"{out.sum()} particles out of the box")
