"""A run that goes on from a checkpoint has the bits of one that was never stopped."""

import gc
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, Checkpoint, InputError, Scene, Simulation, effects, simulate
from taichi_dem.kit.checkpoint import read_checkpoint
from taichi_dem.kit.field_memory import FieldMemory, fields_of
from taichi_dem.mesh.shapes import bar
from taichi_dem.output.record import Recorder
from taichi_dem.simulate import saved_run
from taichi_dem.timeline import MACRO_TICKS
from tests.bar_blast import METHODS, UNTIL, squeezed_scene
from tests.scenes import ROOT

#: Share of the way at which a checkpoint is made: some of the bonds are broken, and bodies meet.
SHARE = 0.905
#: A resident call goes this many substeps before the checkpoint: an odd number, so that bodies
#: that step by two or more of them wait for impulses.
ODD = 5


def every_field():
    """All fields that exist, but for structs, parts and derivatives of others, by id."""
    fields = [thing for thing in gc.get_objects() if isinstance(thing, ti.Field)]
    found = {id(f): f for f in fields if not isinstance(f, ti.lang.struct.StructField)}
    for field in list(found.values()):
        parts = field.vars if isinstance(field, ti.lang.matrix.MatrixField) else ()
        for part in (*parts, field.grad, field.dual):
            found.pop(id(part), None)
    return found


class Run:
    """A started simulation of the bar, with all that a checkpoint takes of it."""

    def __init__(self, method, kind=effects.SphereContact):
        before = every_field()
        self.simulation = Simulation(squeezed_scene(kind), method)
        self.made = [field for key, field in every_field().items() if key not in before]
        self.recorder = Recorder(self.simulation, "left")
        self.simulation.start()
        self.saved = saved_run(self.simulation, self.recorder)
        self.last = round(UNTIL / method.dt0)

    def resume(self, path):
        """Put it where a checkpoint is."""
        self.saved.restore(read_checkpoint(path, self.saved.identity), path)

    def go_odd(self):
        """A few substeps on, to where neither a largest step nor a search ends."""
        simulation = self.simulation
        simulation.driver.substeps = ODD
        simulation.driver.run(self.last * MACRO_TICKS)

    def finish(self):
        """Go on to the end; all that can be compared there."""
        self.recorder.snapshot()
        self.simulation.advance_to(self.last)
        self.simulation.sample()
        self.recorder.sample()
        missing = self.simulation.missing_effects
        columns, frame = self.recorder.history(), self.recorder.frames[-1]
        told = {
            "account": self.simulation.energy_balance.account(),
            "momentum": self.simulation.energy_balance.momentum_errors(),
            "searches": self.simulation.searches,
            "needs": missing.findings(missing.volume),
            "frames": len(self.recorder.frames),
        }
        arrays = {**self.saved.memory.read(), **columns, "damage": frame.damage}
        return {**arrays, **{name: np.array(repr(value)) for name, value in told.items()}}


def differing(first, second):
    """Names under which the bits differ."""
    assert set(first) == set(second)
    return [name for name in first if first[name].tobytes() != second[name].tobytes()]


@pytest.fixture(
    scope="module",
    params=[
        "controlled",
        pytest.param("uniform", marks=pytest.mark.slow),
        pytest.param("implicit", marks=pytest.mark.slow),
        pytest.param("faces", marks=pytest.mark.slow),
    ],
)
def run(request):
    """A run of each method at its start, and one with contact of faces."""
    if request.param == "faces":
        return Run(METHODS["controlled"], effects.FaceContact)
    return Run(METHODS[request.param])


@pytest.fixture(scope="module")
def foretold(run):
    """Evaluations of a largest step at the start, as expected from the levels and as made."""
    run.simulation.advance_to(2)
    expected, before = run.simulation.evaluation_rate(), run.simulation.evaluations()
    run.simulation.advance_to(3)
    return expected * run.simulation.method.dt0, run.simulation.evaluations() - before


def test_time_left_weighs_each_level_by_its_steps(run, foretold):
    """A bond at level k is evaluated 2^k times a largest step; sweeps vary from step to step.

    The expected number is within 3 eps of a whole one: a division and a product.
    """
    expected, made = foretold
    bonds = run.simulation.model.bond_count
    if run.simulation.solves:
        fewest, most = run.simulation.method.sweeps
        assert (1 + fewest) * bonds <= expected <= (1 + most) * bonds
    else:
        assert made >= (4 if run.simulation.schedule.controlled else 1) * bonds
        assert expected == pytest.approx(made, rel=3 * np.finfo(float).eps)


def test_every_field_is_found(run):
    """What is found is saved unless its class says why not: nobody has to remember it."""
    found = {id(one.field) for one in fields_of(run.simulation)}
    assert len(run.made) > 60
    assert [field for field in run.made if id(field) not in found] == []


@pytest.fixture(scope="module")
def straight(run, foretold, tmp_path_factory):
    """Checkpoint on the way, what the run came to, and what its constant fields were before."""
    constant = FieldMemory(run.simulation, "constant")
    before, path = constant.read(), tmp_path_factory.mktemp("saved") / "run.npz"
    run.simulation.advance_to(round(SHARE * run.last))
    run.recorder.sample()
    run.go_odd()
    run.saved.write(path)
    broken, ticks = run.simulation.report().broken_faces, run.simulation.state.tick[None]
    lagging = (run.simulation.state.last_tick.to_numpy() < ticks).any()
    strain = run.simulation.energy_balance.account()["sphere_strain"]
    end = run.finish()
    return path, (broken, ticks, lagging, strain), end, differing(before, constant.read())


def test_the_checkpoint_falls_where_it_is_hard(run, straight):
    """Bodies touch, and where steps differ some wait for their time within a largest step."""
    _, (broken, ticks, lagging, strain), end, _ = straight
    assert strain > 0.0
    assert 0 < broken < (run.simulation.state.broken_tick.to_numpy() >= 0).sum()
    assert int(end["searches"].item()) > 5
    if run.simulation.method.name.startswith("multirate"):
        assert ticks % MACRO_TICKS
        assert lagging


def test_constant_fields_do_not_change(straight):
    assert straight[3] == []


def test_a_resumed_run_has_the_bits_of_a_straight_one(run, straight):
    """Other values stand in all fields before, those of no use hereafter in the scratch ones."""
    path, _, end, _ = straight
    for view in FieldMemory(run.simulation, "scratch").views.values():
        view.fill(1)
    run.resume(path)
    assert differing(end, run.finish()) == []


@pytest.mark.slow
@pytest.mark.parametrize("run", ["uniform"], indirect=True)
def test_a_killed_run_resumes_to_the_same_bits(run, straight, tmp_path):
    """kill -9 twice, at random moments after a checkpoint; then on in this process."""
    path, moments = tmp_path / "run.npz", random.Random(6)
    for resume in (None, path):
        kill_after_checkpoint(path, resume, moments.uniform(0.0, 0.3))
    run.resume(path)
    assert 0.0 < run.simulation.time_s < UNTIL
    run.simulation.advance_to(run.last)
    reached = run.saved.memory.read()
    assert differing({name: straight[2][name] for name in reached}, reached) == []


_CHILD = """
import sys
from taichi_dem import Checkpoint, runtime, simulate
from tests.bar_blast import METHODS, UNTIL, squeezed_scene
runtime.start(threads=1)
path, resume = sys.argv[1], sys.argv[2] or None
keep = Checkpoint(path, every_wall_s=0.02)
simulate(squeezed_scene(), method=METHODS["uniform"], until=UNTIL, samples=20, checkpoint=keep,
    resume=resume)
"""


def kill_after_checkpoint(path, resume, seconds):
    """Start a run, and kill it some seconds after it has saved itself for the first time."""
    before = path.stat().st_mtime_ns if path.exists() else 0
    environment = {**os.environ, "PYTHONPATH": ROOT}
    line = [sys.executable, "-c", _CHILD, str(path), str(resume or "")]
    child = subprocess.Popen(line, cwd=ROOT, env=environment)
    while not path.exists() or path.stat().st_mtime_ns == before:
        assert child.poll() is None
        time.sleep(0.005)
    time.sleep(seconds)
    child.kill()
    assert child.wait() == -signal.SIGKILL


def light_scene(pulse=5e6, cells=(2, 1, 1)):
    """A bar of 12 bodies without contact, quick to compile."""
    acting = [effects.BondDamping(), effects.GasPressure("left", peak=pulse, rise=1e-5)]
    return Scene(bar(0.1, 0.05, cells), CONCRETE, acting)


@pytest.fixture(scope="module")
def light(tmp_path_factory):
    """A straight run through ``simulate``, and the checkpoint at its half."""
    path = tmp_path_factory.mktemp("light") / "run.npz"
    job = {"method": METHODS["uniform"], "samples": 5, "frames": 2}
    half = simulate(light_scene(), until=5e-6, checkpoint=Checkpoint(path), **job)
    assert half.report.substeps > 0
    return path, job


def test_simulate_goes_on_to_a_later_time(light, tmp_path):
    """Its samples and frames follow those that were saved; the old end is no mark any more."""
    path, job = light
    whole = simulate(light_scene(), until=1e-5, **job)
    rest = simulate(light_scene(), until=1e-5, resume=path, **job)
    marks = np.round(1e6 * rest.history["time_s"], 9).tolist()
    assert marks == [0, 1, 2, 3, 4, 5, 6, 8, 10]
    assert len(rest.frames) == 5 - 1
    assert np.array_equal(rest.frames[-1].position, whole.frames[-1].position)
    for name, column in whole.history.items():
        assert rest.history[name][-1] == column[-1], name


def test_a_full_disk_at_the_end_names_the_checkpoint(light, tmp_path, monkeypatch):
    """The last good output stays: the run is saved before anything is written."""
    path, job = light

    def full(name, columns):
        raise InputError(f"cannot write {name}: No space left on device")

    monkeypatch.setattr(sys.modules["taichi_dem.result"], "write_csv", full)
    keep = Checkpoint(tmp_path / "run.npz")
    words = (
        r"history.csv: No space left on device; checkpoint .*run.npz holds the run at t = 5e-06 s"
    )
    with pytest.raises(InputError, match=words):
        simulate(
            light_scene(), until=5e-6, resume=path, checkpoint=keep, output=tmp_path / "out", **job
        )
    assert os.listdir(tmp_path / "out") == []


@pytest.mark.parametrize(
    ("scene", "change", "words"),
    [
        (light_scene(cells=(3, 1, 1)), {}, "of another mesh: 12 tetrahedra"),
        (light_scene(pulse=6e6), {}, "of another effects: .*5000000.0.*6000000.0"),
        (light_scene(), {"method": METHODS["controlled"]}, "of another method: Uniform"),
        (
            light_scene(),
            {"until": 1e-6},
            "until must be at least 5e-06 s, where .* begins, got 1e-06",
        ),
    ],
)
def test_what_does_not_belong_together_is_refused(light, scene, change, words):
    path, job = light
    with pytest.raises(InputError, match=words):
        simulate(scene, resume=path, **{"until": 1e-5, **job, **change})


def test_a_checkpoint_must_be_one():
    with pytest.raises(InputError, match=r"checkpoint must be a Checkpoint or None, got 'run.npz'"):
        simulate(light_scene(), method=METHODS["uniform"], until=1e-6, checkpoint="run.npz")
