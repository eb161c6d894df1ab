"""effects="auto" gives the same bits with any driver and threads, and from a checkpoint."""

import json
import subprocess
import sys

import numpy as np
import pytest

from taichi_dem import Scene, checked_mesh
from taichi_dem.kit.checkpoint import read_checkpoint
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.output.record import Recorder
from taichi_dem.simulate import saved_run
from taichi_dem.timeline import MACRO_TICKS
from tests.activation.late_runs import Run
from tests.activation.late_scenes import (
    METHOD,
    Late,
    late_scene,
    loads,
    rod,
    scene_of,
    simulation,
    strengths,
)
from tests.activation.test_late_methods import METHODS
from tests.processes import users_environment
from tests.scenes import ROOT

SLOW = pytest.mark.slow
KINDS = {"uniform": METHOD, **METHODS}
CASES = ["uniform", *(pytest.param(name, marks=SLOW) for name in ("controlled", "implicit"))]
#: Substeps in which a run goes on to where no largest step ends.
ODD = 5


def found(simulation):
    """All that a run says of bodies, bonds, laws, sleep and audit, by name."""
    state, audit = simulation.state, simulation.step.audit
    fields = dict(state.fields())
    parts = ((state.activity, "since evaluated touched"), (audit, "audited misses"))
    parts += ((state.sleeping, "awake since stride left_out bound2 mean sums"),)
    for part, names in parts:
        fields.update({f"{part!r} {name}": getattr(part, name) for name in names.split()})
    return {name: field.to_numpy() for name, field in fields.items()}


def differing(first, second):
    """Names under which the bits differ."""
    assert set(first) == set(second)
    return [name for name in first if first[name].tobytes() != second[name].tobytes()]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hit 0", "fragment 0"])
@pytest.mark.parametrize("kind", CASES)
def test_both_drivers_give_the_same_bits(kind, name):
    made = [Run(name, "auto", method=KINDS[kind], driver=d) for d in ("resident", "parallel")]
    assert differing(*(found(run.simulation) for run in made)) == []
    assert made[0].report.certificate.as_dict() == made[1].report.certificate.as_dict()


_THREADS = """
import hashlib, json, sys
import numpy as np
from taichi_dem import Scene, runtime
from tests.activation.late_scenes import (
    Late, METHOD, Push, in_a_row, layer, loads, rod, simulation, strengths
)
from tests.activation.test_auto_bits import found
runtime.start(threads=int(sys.argv[1]))
draw = np.random.default_rng(5)
mesh = in_a_row(rod(draw, 1), rod(draw, 110), 1e-3)
late = Late("tension", mesh, loads(), 0.0, ((layer(-1.0, 0.033), (20.0, 0.0, 0.0)),))
scene = Scene(mesh, strengths(3e5), "auto", loads=late.loads)
run = simulation(late, scene, METHOD, "parallel")
run.advance_to(500)
told = {k: hashlib.sha256(v.tobytes()).hexdigest() for k, v in found(run).items()}
told["broken"] = run.report().broken_faces
told["asleep"] = int((run.state.sleeping.awake.to_numpy() == 0).sum())
told["softened"] = int((run.state.activity.since.to_numpy()[:, 0] >= 0).sum())
print(json.dumps(told))
"""


@pytest.mark.slow
def test_threads_change_no_bit():
    """Taichi spreads loops of more than 512 items; the bar has 666 bodies."""
    told = []
    for threads in ("1", "2"):
        line = [sys.executable, "-W", "ignore", "-c", _THREADS, threads]
        environment = users_environment(PYTHONPATH=ROOT)
        done = subprocess.run(line, cwd=ROOT, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        told.append(json.loads(done.stdout.splitlines()[-1]))
    assert told[0]["broken"] > 0 and told[0]["softened"] > 0 and 0 < told[0]["asleep"] < 600
    assert told[0] == told[1]


class Saved:
    """A started run of a scene, with what a checkpoint takes of it."""

    def __init__(self, name, method, **options):
        self.late = late_scene(name)
        self.simulation = simulation(self.late, scene_of(self.late, **options), method)
        recorder = Recorder(self.simulation)
        self.simulation.start()
        self.saved = saved_run(self.simulation, recorder)
        self.last = round(self.late.until / method.dt0)

    def resume(self, path):
        """Put it where a checkpoint is, other values in what a step writes before it reads."""
        for view in FieldMemory(self.simulation, "scratch").views.values():
            view.fill(1)
        self.saved.restore(read_checkpoint(path, self.saved.identity), path)

    def finish(self):
        """Go on to the end."""
        self.simulation.advance_to(self.last)
        return found(self.simulation)


@pytest.mark.parametrize("share", [0.1, 0.45])
@pytest.mark.parametrize("kind", CASES)
def test_a_resumed_run_has_the_bits_of_a_straight_one(kind, share, tmp_path):
    """Stopped before a sleeping bar is hit, and while the wave goes through it."""
    first, second = (Saved("hit 0", KINDS[kind]) for _ in range(2))
    first.simulation.advance_to(round(share * first.last))
    first.simulation.driver.substeps = ODD
    first.simulation.driver.run(first.last * MACRO_TICKS)
    asleep = first.simulation.state.sleeping.awake.to_numpy() == 0
    assert asleep.any()
    first.saved.write(tmp_path / "run.npz")
    second.resume(tmp_path / "run.npz")
    end = first.finish()
    assert differing(end, second.finish()) == []
    told = [run.simulation.report().certificate.as_dict() for run in (first, second)]
    assert told[0] == told[1]


def test_a_checkpoint_is_refused_where_more_or_less_may_sleep(tmp_path):
    first, other = Saved("hit 0", METHOD), Saved("hit 0", METHOD, sleep=1e-4)
    first.saved.write(tmp_path / "run.npz")
    with pytest.raises(InputError, match="on demand"):
        other.resume(tmp_path / "run.npz")
    every = Saved("hit 0", METHOD, word="all")
    with pytest.raises(InputError, match="on demand"):
        every.resume(tmp_path / "run.npz")


def test_a_run_that_begins_again_has_the_same_bits():
    """Nothing of sleep and laws is left in the engine."""
    late = late_scene("fragment 0")
    run = simulation(late, scene_of(late))
    run.advance_to(300)
    other = simulation(late_scene("hit 1"), scene_of(late_scene("hit 1")))
    other.advance_to(700)
    end = found(run)
    again = simulation(late, scene_of(late))
    again.advance_to(300)
    assert differing(end, found(again)) == []
    run.reset()
    assert not run.state.sleeping.awake.to_numpy().any()
    assert not run.state.activity.evaluated.to_numpy().any()


def test_far_from_the_origin_bodies_at_rest_sleep():
    """The rounding of coordinates of 10 km opens no bond by more than is expected of it."""
    mesh = rod(np.random.default_rng(3), 20)
    far = checked_mesh(mesh.points + np.array([1e4, -1e4, 1e4]), mesh.tetrahedra, {})
    asleep = []
    for each in (mesh, far):
        late = Late("tension", each, loads(), 0.0)
        run = simulation(late, Scene(each, strengths(), "auto", loads=late.loads))
        run.advance_to(2)
        asleep.append((run.state.sleeping.awake.to_numpy() == 0).sum())
    assert asleep == [120, 120]
