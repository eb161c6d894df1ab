"""Runs of the paper's blast for comparison: where all bodies are, what broke, where work went."""

from dataclasses import asdict, dataclass

import numpy as np

from _blast import paper_effects
from _hard_cases._case import renew_session
from taichi_dem import CONCRETE, Scene, Simulation, SimulationDiverged
from taichi_dem.simulate import progress_of
from taichi_dem.simulation import macro_steps
from taichi_dem.timeline import NEVER

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
    balance [J]. evaluations: of bonds and contact pairs. cpu_s, wall_s: of stepping. compile_s:
    before it. residual: share of the work that the energy balance does not explain. reached_s:
    time. failure: why the run ended before its time, or nothing; the figures are then those at that
    time.
    """

    moved: list
    broken: list
    energy: dict
    evaluations: int
    cpu_s: float
    wall_s: float
    compile_s: float
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
    renew_session()
    simulation = Simulation(Scene(mesh, CONCRETE, paper_effects()), method, driver)
    if seed is not None:
        _disturb(simulation, seed)
    simulation.start()
    failure = ""
    try:
        simulation.advance_to(
            macro_steps(until, method.dt0),
            (lambda: progress(progress_of(simulation, until))) if progress else None,
        )
    except SimulationDiverged as error:
        failure = str(error)
    return _outcome(simulation, failure)


def _disturb(simulation, seed):
    place = simulation.model.centre
    noise = np.random.default_rng(seed).uniform(-DISTURBANCE, DISTURBANCE, place.shape)
    simulation.state.set_motion(place + noise, np.tile([1.0, 0.0, 0.0, 0.0], (len(place), 1)))


def _outcome(simulation, failure):
    report = simulation.report()
    moved = simulation.state.motion()["position"] - simulation.model.centre
    return Outcome(
        moved=moved.tolist(),
        broken=np.flatnonzero(simulation.state.broken_tick.to_numpy() != NEVER).tolist(),
        energy=report.energy_balance,
        evaluations=report.contact_evaluations,
        cpu_s=report.run_cpu_seconds,
        wall_s=report.run_seconds,
        compile_s=report.compile_seconds,
        residual=report.energy_residual_fraction,
        reached_s=report.until_s,
        failure=failure,
    )


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
