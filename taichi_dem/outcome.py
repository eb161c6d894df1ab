"""Outcome of a run: where all bodies are, which bonds broke, where the work went; and distances.

Two methods that solve one scene are compared by their outcomes.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.display import by_fields
from taichi_dem.result import Result
from taichi_dem.scene import Scene
from taichi_dem.simulate import result_of, run_simulation
from taichi_dem.simulation import Simulation

#: Where the work of the loads goes; together with the rest they are the energy split.
SPLIT = (
    *("kinetic", "bond_strain", "sphere_strain", "bond_dashpot", "softening", "release"),
    *("slip", "sphere_dashpot", "friction", "injected"),
)


@dataclass(frozen=True)
class Outcome:
    """A run at its end, in numbers that a JSON file holds.

    moved: displacements [m], (n, 3) as lists. broken: released bonds. energy: terms of the energy
    balance [J]. evaluations: of bonds and contact pairs. cpu_s, wall_s: of stepping.
    compile_seconds: before it. residual: share of the work that the energy balance does not
    explain. reached_s: time. failure: the sentence of a run that diverged, or nothing; the figures
    are then those at that time.
    """

    moved: list
    broken: list
    energy: dict
    evaluations: int
    cpu_s: float
    wall_s: float
    compile_seconds: float
    residual: float
    reached_s: float
    failure: str = ""

    def __repr__(self) -> str:
        return by_fields(self)

    @classmethod
    def of(cls, result: Result) -> "Outcome":
        """Outcome of a result with at least one frame, the last at its end."""
        report = result.report
        return cls(
            moved=result.frames[-1].displacement.tolist(),
            broken=np.flatnonzero(~np.isnan(result.broken_time)).tolist(),
            energy=report.energy_balance,
            evaluations=report.contact_evaluations,
            cpu_s=report.run_cpu_seconds,
            wall_s=report.run_seconds,
            compile_seconds=report.compile_seconds,
            residual=report.energy_residual_fraction,
            reached_s=report.until_s,
            failure=result.diverged,
        )

    def as_dict(self) -> dict[str, Any]:
        """All of it, for a JSON file; ``Outcome(**content)`` reads it back."""
        return asdict(self)


def outcome_of(
    scene: Scene,
    method: Any,
    until: float,
    *,
    driver: str = "auto",
    progress: Any = None,
    disturbance: float = 0.0,
    seed: int = 1,
) -> Outcome:
    """Run a scene by a method to a time [s]; returns its Outcome, also where it diverges.

    disturbance: most that each coordinate of the bodies is moved by at the start [m], at random:
    two runs that differ by round-off alone show how far a result can be trusted.
    """
    simulation = Simulation(scene, method, driver)
    if disturbance:
        centre = simulation.model.centre
        noise = np.random.default_rng(seed).uniform(-disturbance, disturbance, centre.shape)
        simulation.state.set_motion(centre + noise, **scene.initial_motion)
    looks: Any = {"samples": 1, "frames": 1, "progress": progress}
    return Outcome.of(result_of(run_simulation, simulation, until=until, **looks))


def displacement_error(run: Outcome, reference: Outcome) -> float:
    """RMS over all bodies of the difference in displacement, as a share of the reference's RMS."""
    true = np.array(reference.moved)
    return _over(float(np.linalg.norm(np.array(run.moved) - true)), float(np.linalg.norm(true)))


def faces_error(run: Outcome, reference: Outcome) -> float:
    """Faces broken in one of the two only, as a share of the reference's broken faces."""
    odd = set(run.broken) ^ set(reference.broken)
    return len(odd) / max(1, len(reference.broken))


def energy_error(run: Outcome, reference: Outcome) -> float:
    """Half the sum over the terms of their differences, as a share of the loads' work.

    Half, as what is missing in one term is too much in another.
    """
    apart = sum(abs(run.energy[name] - reference.energy[name]) for name in SPLIT)
    return _over(0.5 * apart, abs(reference.energy["load_work"]))


def _over(apart, whole):
    """A difference over the size of a reference; infinite where only the reference is zero."""
    return apart / whole if whole else math.inf if apart else 0.0
