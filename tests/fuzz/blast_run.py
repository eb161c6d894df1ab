"""Run a random scene of the blast, and judge what it gives by what mechanics allows."""

import os
import signal
import tempfile
import time

import numpy as np

from taichi_dem import Checkpoint, Simulation, simulate
from taichi_dem.diagnostics.energy_balance import unexplained_share
from taichi_dem.kit.checkpoint import Interrupted
from taichi_dem.kit.units import unit_of
from taichi_dem.observers import Collector, Every
from taichi_dem.simulate import run_simulation
from tests.fuzz.ends import OutOfTime, Wrong

SAMPLES = 8
#: Largest error of linear momentum over that exchanged: rounding of 500 steps and of places.
MOMENTUM = 1e-9
#: Share of all energy that went through the scene which its account may leave unexplained; a run
#: that leaves more has to say so.
UNEXPLAINED = 0.5


class WallClock:
    """Observer that stops a run some seconds after its first step."""

    when = Every(wall_s=0.5)

    def __init__(self, seconds):
        self.seconds, self.end = seconds, None

    def observe(self, view):
        """Raise OutOfTime when it is over; compiling was before."""
        self.end = self.end or time.monotonic() + self.seconds
        if time.monotonic() > self.end:
            raise OutOfTime


class CtrlC:
    """Observer that sends this process what Ctrl-C sends, once, at half of the samples."""

    when = Every(samples=1)

    def __init__(self):
        self.calls = 0

    def observe(self, view):
        """Count, and interrupt."""
        self.calls += 1
        if self.calls == SAMPLES // 2:
            os.kill(os.getpid(), signal.SIGINT)


def run_blast(trial, seconds):
    """Run a ``BlastScene``; returns the warnings of its report. Raises Wrong for wrong numbers."""
    trial.build()
    until, draws = trial.steps * trial.method.dt0, trial.draws
    result = moving(trial, until, "resident", seconds)
    judge(result)
    if trial.kind.both and draws.chance(0.2):
        same_bits(result, moving(trial, until, "parallel", seconds), "parallel loops")
    if draws.chance(0.15) and not result.report.unresolved:
        interrupted(trial, until, seconds)
    return result.report.unresolved


def moving(trial, until, driver, seconds):
    """Result of a run with the first motion of a scene."""
    simulation = Simulation(trial.scene, trial.method, driver)
    place = simulation.model.centre + trial.motion["shift"]
    simulation.state.set_motion(place, None, trial.motion["velocity"], trial.motion["spin"])
    watch = {"samples": SAMPLES, "frames": 1, "progress": None, "observers": [WallClock(seconds)]}
    return run_simulation(simulation, until=until, **watch)


def judge(result):
    """Raise Wrong for numbers that are none, momentum from nowhere, or an account left open."""
    arrays = {**result.history, "peak speed": result.peak_speed}
    for frame in result.frames:
        names = ("position", "rotation", "velocity", "damage")
        arrays.update({f"{name} of a frame": getattr(frame, name) for name in names})
    bad = [name for name, values in arrays.items() if not np.isfinite(values).all()]
    if bad:
        raise Wrong(f"no finite numbers without a word: {', '.join(bad)}")
    unnamed = [name for name in result.history if not unit_of(name)]
    if unnamed:
        raise Wrong(f"columns without a unit: {', '.join(unnamed)}")
    report = result.report
    # Where supports hold all that is loaded, bodies exchange nothing but rounding.
    moved = result.history["kinetic_J"].max() > report.round_off_J
    if moved and not report.linear_momentum_error <= MOMENTUM:
        raise Wrong(f"momentum error {report.linear_momentum_error:.3g} of that exchanged")
    share = unexplained_share(report.energy_balance, report.round_off_J)
    if not share <= UNEXPLAINED and not report.unresolved:
        raise Wrong(f"{100.0 * share:.3g} % of the energy unexplained, and no warning")


def same_bits(first, second, what):
    """Raise Wrong unless two results are the same to the bit."""
    names = [n for n in first.history if _bytes(first.history[n]) != _bytes(second.history[n])]
    names += ["velocity"] * (
        _bytes(first.frames[-1].velocity) != _bytes(second.frames[-1].velocity)
    )
    if names:
        raise Wrong(f"other bits by {what}: {', '.join(names)}")


def _bytes(values):
    return np.asarray(values).tobytes()


def interrupted(trial, until, seconds):
    """Interrupt a run from rest, once without a checkpoint; a resumed one has the same bits."""
    options = {"method": trial.method, "until": until, "driver": "resident", "samples": SAMPLES}
    options.update(frames=1, progress=None)
    whole = simulate(trial.scene, **options, observers=[WallClock(seconds)])
    # A shell may have its background jobs ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "saved.npz")
        saving = {"checkpoint": Checkpoint(path)} if trial.draws.chance(0.7) else {}
        try:
            simulate(trial.scene, **options, **saving, observers=[CtrlC()])
            raise Wrong("Ctrl-C was not answered")
        except Interrupted:
            options["resume"] = path
        except KeyboardInterrupt:
            if saving:
                raise Wrong("Ctrl-C ended a run that should have saved itself") from None
        again = simulate(trial.scene, **options, observers=[Collector(Every(samples=1))])
    same_bits(whole, again, "interruption")
