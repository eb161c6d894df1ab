"""A random scene of the damper: a filling, a table of few scenes, and how it is shaken."""

from typing import Any, NamedTuple

from ca_damper import Automaton, RigidMass, SceneTable, Spheres
from tests.fuzz.draws import Draws


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
