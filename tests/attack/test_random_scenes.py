"""A random scene ends with sound numbers, refused, or named as diverged: nothing else may happen.

It depends on its number alone. ``--attacks 500`` draws 500 of each kind; a scene that ends the
process counts as a failure with pytest-xdist.
"""

import time

import numpy as np
import pytest

from ca_damper import RigidMass
from ca_damper.plot.boxes import BoxSize
from taichi_dem import InputError, SimulationDiverged, runtime, simulate
from taichi_dem.observers import Every
from taichi_dem.report.energy_balance import unexplained_share
from tests.attack.scenes import BLASTS, DAMPERS, Draws, blast, damper
from tests.damper import expected, momentum_rounding

pytestmark = pytest.mark.attack

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


@pytest.fixture(scope="module", autouse=True, params=["usual", "bounds"])
def taichi_session(request):
    """The second time with every access to a field checked."""
    runtime.stop()
    runtime.start(threads=2, debug=request.param == "bounds")
    yield
    runtime.stop()


def assert_sound(values, names):
    for name in names:
        assert np.isfinite(np.asarray(values[name])).all(), f"no finite {name}, without a word"


def run_blast(draws, kind):
    """No number that is none, no momentum from nowhere, no account left open, without a word."""
    scene, method = blast(draws, kind)
    until = method.dt0 * int(draws.power(1.0, 2.7))
    watch = {"samples": 8, "frames": 1, "progress": None, "observers": [Clock()]}
    result = simulate(scene, method=method, until=until, driver="resident", **watch)
    report = result.report
    assert_sound(result.series, result.series)
    assert_sound(vars(result.frames[-1]), ("position", "rotation", "velocity", "damage"))
    # Where supports hold all that is loaded, bodies exchange nothing but rounding.
    if result.series["kinetic_J"].max() > report.round_off_J:
        assert report.linear_momentum_error <= MOMENTUM
    share = unexplained_share(report.energy_balance, report.round_off_J)
    assert share <= UNEXPLAINED or report.unresolved, f"{share:.3g} of the energy unexplained"


def run_damper(draws, kind):
    """No particle is lost, no number is none, and no momentum comes from nowhere."""
    batch = damper(draws, kind)
    filling = batch.fillings.kinds[0]
    run_from_rest(batch)
    for scene, count in enumerate(batch.table.column("particles")):
        shot = batch.snapshot(scene)
        assert_sound(shot, shot)
        if not isinstance(filling, RigidMass):
            assert len(shot["position"]) == count
            assert_inside(filling, shot["position"])
    if getattr(getattr(filling, "rules", None), "accounting", "all") not in LOSSY:
        assert batch.report().momentum_error <= momentum_rounding(batch)


def run_from_rest(batch):
    """A cycle, or as many steps as are allowed."""
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


def assert_inside(filling, place):
    """All particles lie in the box."""
    box = BoxSize.of(filling)
    # In an automaton every other column stands half a cell higher, and one may be under way.
    slack = box.diameter * (1.0 if box.staggered else 0.5)
    top = np.array([box.width, box.height + 0.5 * slack])
    assert ((place >= -slack) & (place <= top + slack)).all(), "particles out of the box"


@pytest.mark.parametrize("kind", [*BLASTS, *DAMPERS], ids=lambda kind: "-".join(map(str, kind)))
# Sentences of the packages about what a scene lists in vain.
@pytest.mark.filterwarnings("error", "ignore::UserWarning")
def test_a_random_scene_is_explained(kind, seed):
    """A refusal is one sentence, and all else than it a failure."""
    run = run_blast if kind in BLASTS else run_damper
    try:
        run(Draws(seed), kind)
    except OutOfTime:
        pass
    except (InputError, SimulationDiverged) as error:
        words = str(error)
        assert words.strip() and "\n" not in words and len(words) <= 1000
