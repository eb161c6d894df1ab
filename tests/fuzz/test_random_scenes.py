"""A random scene ends with sound numbers, refused, or named as diverged: nothing else may happen.

It depends on its number alone. ``--attacks 500`` draws 500 of each kind; a scene that ends the
process counts as a failure with pytest-xdist.
"""

import warnings

import pytest

from taichi_dem import InputError, SimulationDiverged, runtime
from tests.fuzz import blast_scene, damper_scene
from tests.fuzz.blast_scene import BlastScene
from tests.fuzz.damper_scene import DamperScene
from tests.fuzz.running import OutOfTime, run_blast, run_damper

pytestmark = pytest.mark.attack

#: A number takes the kind of its remainder.
KINDS = (*blast_scene.KINDS, *damper_scene.KINDS)
#: Numbers of scenes that once ended in another way, and what was wrong.
MENDED = {
    41: "0 times infinity where contacts have no damping, in the report of limited dashpots",
    3967: "a runaway overflowed the look for shared volume before it was named",
    313: "dashpots stopped the first motion within a step: heat was booked wrong, unsaid",
    6096: "grains by the rules of place that were pushed out of their box had no name",
    42037: "a search for bodies whose place was no number wrote where no cell is",
    687: "a step beyond the limit of dashpots left nearly all energy open, and nothing said so",
    50929: "the momentum of a runaway overflowed in the report of the run",
    40741: "what a support takes from a load left no momentum to measure an error by",
}


@pytest.fixture(scope="module", autouse=True, params=["usual", "bounds"])
def taichi_session(request):
    """The second time with every access to a field checked."""
    runtime.stop()
    runtime.start(threads=2, debug=request.param == "bounds")
    yield request.param
    runtime.stop()


def assert_explained(number):
    """Run the scene of a number: a refusal is one sentence, and all else than it a failure."""
    kind = KINDS[number % len(KINDS)]
    blast = isinstance(kind, blast_scene.Kind)
    trial = (BlastScene if blast else DamperScene)(number, kind)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            # Sentences of the packages about what a scene lists in vain.
            warnings.simplefilter("ignore", UserWarning)
            (run_blast if blast else run_damper)(trial)
    except OutOfTime:
        pass
    except (InputError, SimulationDiverged) as error:
        words = str(error)
        assert words.strip() and "\n" not in words and len(words) <= 1000


@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_a_random_scene_is_explained(kind, seed):
    assert_explained(kind + seed * len(KINDS))


@pytest.mark.parametrize("number", MENDED)
def test_a_scene_that_was_mended_stays_so(number):
    assert_explained(number)
