"""Sources of error beside the step: each is measured by its formula, or named as not measured."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from cases.meshes import with_moved_nodes
from taichi_dem import CONCRETE, InputError, Scene, effects, goals, solve
from taichi_dem.accuracy import sources
from taichi_dem.accuracy.levels import Levels
from taichi_dem.accuracy.runs import Runs
from taichi_dem.accuracy.sources import Beside, finer_law, with_contact
from taichi_dem.effects import BodyContact, SphereContact
from taichi_dem.kit.bars.answer import Answer, Branch, ErrorParts, Plan, branched, with_source
from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.bars.runs import Question
from taichi_dem.mesh.shapes import bar
from tests.scenes import UNTIL, struck_bar

BAR = bar(0.1, 0.05, (2, 1, 1))
HOLDS, FAILS = SimpleNamespace(holds=True), SimpleNamespace(holds=False, asleep=0.5)


def touching(law=None, word=None):
    """A scene with a contact law."""
    given = [effects.GasPressure("left", peak=5e6, rise=1e-5), *([law] if law else [])]
    if word:
        return Scene(BAR, CONCRETE, word, loads=given)
    return Scene(BAR, CONCRETE, given)


@pytest.fixture
def found():
    """Sources by name of a question whose runs have the values of a formula of their scene."""

    def sources_of(
        scene,
        formula,
        asked=("step",),
        meshes=(),
        pairs=1,
        certificate=None,
        budget=9,
        events=False,
    ):
        class Made(Runs):
            seconds, cost = 2.0, None

            def value(self, level):
                return formula(self.levels.scene)

            def eventful(self, level):
                return events

            def release(self):
                """Nothing is held."""

        goal = goals.kinetic_energy()
        asked_about = Question((goal,), sources=asked)
        runs = Made(Levels(scene, UNTIL, goal), None, asked_about, meshes)
        runs.cost = {0: 1.0}
        report = SimpleNamespace(pair_evaluations=pairs, certificate=certificate)
        beside = Beside(runs, 0, report, lambda runs: runs <= budget)
        return {one.name: one for one in beside.sources(0)}

    return sources_of


def by_rays(scene):
    """3 + 0.9 / parts^2: what a law of second order gives; spheres are off by 0.5."""
    law = scene.effect("contact")
    return 3.5 if type(law) is SphereContact else 3.0 + 0.9 / law.geometry.parts**2


@pytest.mark.parametrize("parts", [2, 3, 4, 5])
@pytest.mark.parametrize("word", ["", "auto", "all"])
def test_rays_have_the_error_that_their_order_tells(found, parts, word):
    one = found(touching(BodyContact(parts), word), by_rays, ("step", "contact"))["contact"]
    assert one.error == pytest.approx(0.9 / parts**2, rel=1e-9)
    assert one.seconds == 2.0


def test_spheres_are_as_far_off_as_bodies_say(found):
    one = found(touching(SphereContact()), by_rays, ("step", "contact"))["contact"]
    assert one.error == pytest.approx(abs(3.5 - by_rays(touching(BodyContact(6)))), rel=1e-9)


def test_what_cannot_be_measured_is_named(found):
    """The finest law; a law that nobody refines; a spent budget; other meshes that lack."""
    scene = touching(BodyContact(sources.MOST_PARTS))
    assert not found(scene, by_rays, ("step", "contact"))["contact"].measured
    assert finer_law(object())[0] is None
    spent = found(touching(BodyContact(3)), by_rays, ("step", "contact"), budget=1)
    assert not spent["contact"].measured and not spent["mesh"].measured
    asked = found(touching(BodyContact(3)), by_rays)
    assert not asked["contact"].measured and asked["contact"].seconds > 1.0


def test_contact_is_no_source_where_there_is_none(found):
    assert "contact" not in found(touching(), lambda scene: 3.0)
    apart = found(touching(BodyContact(3)), by_rays, pairs=0)
    assert apart["contact"].measured and apart["contact"].error == 0.0


def test_meshes_spread_as_student_says(found):
    """The half-width for one of n + 1 values that scatter: t of n degrees times their deviation."""
    sizes = [0.1, 0.12, 0.09, 0.13]
    meshes = [bar(size, 0.05, (2, 1, 1)) for size in sizes[1:]]
    one = found(touching(), _length, ("step", "mesh"), meshes)["mesh"]
    assert one.error == pytest.approx(t_quantile(0.95, 3) * np.std(sizes, ddof=1), rel=1e-9)


def _length(scene):
    return float(np.ptp(scene.mesh.points[:, 0]))


def test_runs_that_diverge_leave_no_bound(found):
    diverging = found(
        touching(BodyContact(3)),
        lambda scene: (
            3.0 if scene.effect("contact").geometry.parts == 3 and scene.mesh is BAR else None
        ),
        ("step", "contact", "mesh"),
        [bar(0.2, 0.05, (2, 1, 1))] * 2,
    )
    assert diverging["contact"].error == diverging["mesh"].error == math.inf


@pytest.mark.parametrize("certificate", [None, HOLDS, FAILS], ids=str)
def test_a_certificate_that_does_not_hold_is_a_source_without_a_measure(found, certificate):
    one = found(touching(), lambda scene: 3.0, certificate=certificate)["left out"]
    assert one.measured == (certificate is None or certificate.holds)


@pytest.mark.parametrize("word", ["", "auto"])
def test_a_scene_with_another_contact_keeps_all_else(word):
    scene = touching(BodyContact(3), word)
    other = with_contact(scene, BodyContact(6))
    assert other.effect("contact").geometry.parts == 6 and other.on_demand == scene.on_demand
    assert [type(one) for one in other.effects] == [type(one) for one in scene.effects]


@pytest.mark.parametrize("value", [2.0, 0.0])
def test_what_is_reached_is_as_narrow_as_asked_with_all_sources(value):
    """Drawn parts of a bar: the sum of their squares decides, and each step keeps the doubts."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        step, *others = value * 0.05 * rng.uniform(0.0, 1.5, 3) + (value == 0.0) * rng.random(3)
        made = Answer(
            *("goal", "m", value, ErrorParts(step=step), 0.05, 0.95, Plan("none", 1, 0.0, 0.0)),
            shortfall="" if step <= 0.05 * value else "the step",
            sources=(Source("step", step, "two runs"),),
        )
        for name, error in zip(("contact", "mesh"), others):
            made = with_source(made, Source(name, error, "measured"))
        assert made.error == pytest.approx(np.linalg.norm([step, *others]))
        assert made.reached == (made.error <= 0.05 * value)
        assert made.budget.error.tolist() == [step, *others]


@pytest.mark.parametrize("events", [False, True])
def test_a_mesh_that_is_not_measured_has_the_error_that_half_of_all_questions_exceed(found, events):
    """More where something breaks, and none of its own where it is measured."""
    plain = found(touching(), lambda scene: -3.0, events=events)["mesh"]
    assert plain.common == pytest.approx(3.0 * sources.COMMON[events])
    assert sources.COMMON[False] < sources.COMMON[True]
    asked = found(touching(), _length, ("step", "mesh"), [BAR, BAR], events=events)["mesh"]
    assert asked.common == 0.0


def test_a_branch_keeps_what_was_measured_beside_the_step():
    """Its bar is the root of the squares of the sources that it names."""
    listed = [Source(name, 1.0, "runs") for name in ("step", "chance", "contact", "mesh")]
    parts = ErrorParts(step=0.6, solver=0.8, chance=1.0, contact=1.0, mesh=1.0)
    plan = Plan("a method", 2, 1.0, 0.0)
    one = Answer("way", "mm", 3.0, parts, 0.1, 0.95, plan, sources=tuple(listed))
    ends = (Branch(2.0, 0.1, 0.5, 0.3, (0,)), Branch(4.0, 0.1, 0.5, 0.3, (1,)))
    found = branched(one, ends, 0.3, "run", "came to {} ends")
    assert found.error == pytest.approx(np.sqrt((found.budget.error**2).sum()), rel=1e-12)
    assert found.parts.contact == found.parts.mesh == 1.0 and found.parts.chance == 0.1


def test_a_bar_is_the_root_of_the_squares_of_its_sources():
    """Of a real scene, in other meshes; nothing touches in it."""
    scene, goal = struck_bar(), goals.kinetic_energy()
    others = [with_moved_nodes(scene.mesh, 1e-3, seed) for seed in range(2)]
    answer = solve(scene, until=UNTIL, goal=goal, sources=["mesh"], meshes=others, progress=None)
    budget = answer.budget
    assert {"step", "mesh"} <= {*budget.index} and budget.in_bar.all()
    assert (budget.error[["step", "mesh"]] > 0.0).all()
    assert answer.error == pytest.approx(np.sqrt((budget.error**2).sum()))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"sources": ["luck"]}, "sources must be one of step, contact, mesh, got 'luck'"),
        ({"sources": ["mesh"]}, "meshes must be two or more where sources name the mesh"),
        ({"sources": ["mesh"], "meshes": [BAR]}, "meshes must be two or more"),
        ({"meshes": [BAR, BAR]}, "and none elsewhere, got 2 and sources step"),
        ({"sources": ["mesh"], "meshes": ["a mesh"]}, "meshes must be"),
    ],
)
def test_bad_sources_are_refused(given, words):
    with pytest.raises(InputError, match=words):
        solve(struck_bar(), until=UNTIL, goal=goals.kinetic_energy(), **given)
