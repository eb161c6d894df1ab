"""Runs of the paper's blast for comparison: where all bodies are, what broke, where work went."""

from dataclasses import asdict, dataclass

import numpy as np

from _blast import paper_effects
from _demo import set_moving
from taichi_dem import CONCRETE, At, Scene, Simulation, SimulationDiverged, runtime
from taichi_dem.simulate import run_simulation

#: How far bodies are displaced at the start of a run that differs by round-off only [m].
DISTURBANCE = 1e-12
#: Where the work of the gas goes; together with what is missing they are the energy split.
SPLIT = (
    *("kinetic", "bond_strain", "sphere_strain", "bond_dashpot", "softening", "release"),
    *("slip", "sphere_dashpot", "friction", "injected"),
)


@dataclass(frozen=True)
class Outcome:
    """A run at its end.

    moved: displacements [m], (n, 3) as lists. broken: released bonds. energy: terms of the energy
    balance [J]. evaluations: of bonds and contact pairs. cpu_s, wall_s: of stepping.
    compile_seconds: before it. residual: share of the work that the energy balance does not
    explain. reached_s: time. failure: why the run ended before its time, or nothing; the figures
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

    def as_dict(self):
        """For a JSON file."""
        return asdict(self)


def blast(mesh, method, until, driver="auto", seed=None, progress=None):
    """Run the paper's blast by a method to a time [s]; returns an Outcome.

    seed: None, or of the disturbance of all positions by DISTURBANCE.
    """
    runtime.clear()
    simulation, failure = Simulation(Scene(mesh, CONCRETE, paper_effects()), method, driver), ""
    if seed is not None:
        noise = np.random.default_rng(seed).uniform(-DISTURBANCE, DISTURBANCE, (mesh.body_count, 3))
        set_moving(simulation, np.zeros_like(noise), noise)
    last = Last()
    try:
        run_simulation(simulation, until=until, samples=1, progress=progress, observers=[last])
    except SimulationDiverged as error:
        failure = str(error)
    view, report = last.view, last.view.report()
    return Outcome(
        moved=(view.motion()["position"] - view.model.centre).tolist(),
        broken=np.flatnonzero(view.broken).tolist(),
        energy=report.energy_balance,
        evaluations=report.contact_evaluations,
        cpu_s=report.run_cpu_seconds,
        wall_s=report.run_seconds,
        compile_seconds=report.compile_seconds,
        residual=report.energy_residual_fraction,
        reached_s=report.until_s,
        failure=failure,
    )


class Last:
    """Observer that keeps the view, to look at the run where it has ended."""

    when = At((0.0,))

    def observe(self, view):
        """Keep the view."""
        self.view = view


def displacement_error(run, reference):
    """RMS over all bodies of the difference in displacement, as a share of the reference's RMS."""
    true = np.array(reference.moved)
    return float(np.linalg.norm(np.array(run.moved) - true) / np.linalg.norm(true))


def faces_error(run, reference):
    """Faces broken in one of the two only, as a share of the reference's broken faces."""
    odd = set(run.broken) ^ set(reference.broken)
    return len(odd) / max(1, len(reference.broken))


def energy_error(run, reference):
    """Half the sum over the terms of their differences, as a share of the gas's work.

    Half, as what is missing in one term is too much in another.
    """
    apart = sum(abs(run.energy[name] - reference.energy[name]) for name in SPLIT)
    return 0.5 * apart / abs(reference.energy["load_work"])


MEASURES = {
    "displacement": (displacement_error, "displacement field"),
    "faces": (faces_error, "faces broken in one only"),
    "energy": (energy_error, "energy split / work of the gas"),
}
