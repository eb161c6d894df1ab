"""Run a random scene of either package, and judge what it gives by what mechanics allows."""

import time

import numpy as np

from ca_damper import Batch, RigidMass, SceneTable
from ca_damper.plot.boxes import Box
from taichi_dem import Simulation
from taichi_dem.observers import Every
from taichi_dem.report.energy_balance import unexplained_share
from taichi_dem.simulate import run_simulation
from tests.paper import expected
from tests.rounding import momentum_rounding

#: Time of a scene [s]; after that, one that still answers is left.
SECONDS = 5.0
#: Steps of a damper: enough for grains to fall through the box, few enough to be short.
STEPS = 2000
#: Largest error of linear momentum over that exchanged: rounding of 500 steps and of places.
MOMENTUM = 1e-9
#: Share of all energy that went through the scene which its account may leave unexplained; a run
#: that leaves more has to say so.
UNEXPLAINED = 0.5
#: Accountings by which some momentum never reaches the container.
LOSSY = ("landing", "landing+ejection")


class OutOfTime(Exception):
    """The time of a scene is over; raised by an observer, so that the run was still answering."""


class Clock:
    """Observer of a blast and listener of a damper that stops a run after its time."""

    when = Every(wall_s=0.5)

    def __init__(self):
        self.end = None

    def observe(self, view):
        """Raise OutOfTime when it is over; compiling was before."""
        self.end = self.end or time.monotonic() + SECONDS
        if time.monotonic() > self.end:
            raise OutOfTime

    __call__ = observe


def run_blast(trial):
    """Run a ``BlastScene``, some again in parallel loops."""
    trial.build()
    result = moving(trial, "resident")
    judge_blast(result)
    if trial.kind.both and trial.draws.chance(0.2):
        other = moving(trial, "parallel")
        for name, column in result.series.items():
            assert column.tobytes() == other.series[name].tobytes(), f"{name} by parallel loops"
        assert same(vars(result.frames[-1]), vars(other.frames[-1]), ("velocity",))


def moving(trial, driver):
    """Result of a run with the first motion of a scene."""
    simulation = Simulation(trial.scene, trial.method, driver)
    place = simulation.model.centre + trial.motion["shift"]
    simulation.state.set_motion(place, None, trial.motion["velocity"], trial.motion["spin"])
    watch = {"samples": 8, "frames": 1, "progress": None, "observers": [Clock()]}
    return run_simulation(simulation, until=trial.steps * trial.method.dt0, **watch)


def judge_blast(result):
    """No number that is none, no momentum from nowhere, no account left open, without a word."""
    report = result.report
    for name, column in result.series.items():
        assert np.isfinite(column).all(), f"no finite {name}, without a word"
    for frame in result.frames:
        for name in ("position", "rotation", "velocity", "damage"):
            assert np.isfinite(getattr(frame, name)).all(), f"no finite {name}, without a word"
    # Where supports hold all that is loaded, bodies exchange nothing but rounding.
    if result.series["kinetic_J"].max() > report.round_off_J:
        assert report.linear_momentum_error <= MOMENTUM
    share = unexplained_share(report.energy_balance, report.round_off_J)
    assert share <= UNEXPLAINED or report.unresolved, f"{share:.3g} of the energy unexplained"


def run_damper(trial):
    """Run a ``DamperScene``, some scenes again alone: each depends on its own row only."""
    trial.build()
    batch, shots = shaken(trial, trial.table)
    judge_damper(trial, batch, shots)
    if trial.draws.chance(0.2) and trial.table.count > 1:
        last = trial.table.count - 1
        (alone,) = shaken(trial, SceneTable(**trial.table.row(last)))[1]
        assert same(shots[last], alone, alone), "other bits alone than in a batch"


def same(first, second, names):
    """Whether values are the same to the bit."""
    return all(np.asarray(first[n]).tobytes() == np.asarray(second[n]).tobytes() for n in names)


def shaken(trial, table):
    """Batch and snapshots of its scenes after a run from rest."""
    batch = Batch(trial.filling, table, mount=trial.kind.mount)
    with expected(batch):
        batch.start()
    if batch.steps_per_cycle.max() <= STEPS:
        record = batch.run(0, 1, Clock()).record
        assert np.isfinite(record[~batch.diverged]).all(), "no finite measures"
    else:
        batch.advance(STEPS, Clock())
    # The other scenes of a batch go on, and a warning names those that diverged.
    if batch.diverged.any():
        raise batch.divergences()[0]
    return batch, [batch.snapshot(s) for s in range(table.count)]


def judge_damper(trial, batch, shots):
    """No particle is lost, no number is none, and no momentum comes from nowhere."""
    filling = trial.filling
    for count, shot in zip(batch.table.column("particles"), shots):
        for name, values in shot.items():
            assert np.isfinite(np.asarray(values)).all(), f"no finite {name}, without a word"
        if not isinstance(filling, RigidMass):
            assert len(shot["position"]) == count
            assert_inside(filling, shot["position"])
    if getattr(filling, "accounting", "all") not in LOSSY:
        assert batch.report().momentum_error <= momentum_rounding(batch)


def assert_inside(filling, place):
    """All particles lie in the box."""
    box = Box.of(filling)
    # In an automaton every other column stands half a cell higher, and one may be under way.
    slack = box.diameter * (1.0 if box.staggered else 0.5)
    top = np.array([box.width, box.height + 0.5 * slack])
    assert ((place >= -slack) & (place <= top + slack)).all(), "particles out of the box"
