"""Bad meshes, scenes, tables, jobs and calls that no single option is to blame for."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ca_damper import (
    Automaton,
    Batch,
    Empty,
    Oscillator,
    RigidMass,
    SceneTable,
    Spheres,
    film,
    frequency_response,
    goals,
    rk45,
    solve_response,
    sweep_up_and_down,
)
from ca_damper import needed_effects as damper_needs
from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    InputError,
    Mesh,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    checked_mesh,
    effects,
    needed_effects,
    quality_report,
    simulate,
    step_report,
)
from taichi_dem.mesh.face_groups import with_cut, with_inner_group, with_outer_group
from taichi_dem.mesh.shapes import bar, pair, single
from tests.bad_input.refusals import assert_refused, steady
from tests.paper import paper

PAIR = pair()
CUT = with_inner_group(PAIR, "notch", lambda x: x[:, 0] < 1.0)
POINTS, BODIES, GROUPS = PAIR.points, PAIR.tetrahedra, PAIR.groups


def mesh(points=POINTS, bodies=BODIES, groups=GROUPS, **options):
    """The pair with something else in it."""
    return checked_mesh(points, bodies, groups, **options)


def moved(value):
    """The pair's points, one coordinate of which is something else."""
    points = POINTS.copy()
    points[3, 1] = value
    return points


MESHES = {
    "no array": (lambda: mesh(points=None), "points must be an array"),
    "text": (lambda: mesh(points="abc"), "points must be an array"),
    "words": (lambda: mesh(points=[["1", "2", "3"]]), "points must be an array"),
    "ragged": (lambda: mesh(points=[[1, 2, 3], [1, 2]]), "points must be an array"),
    "huge whole": (lambda: mesh(points=[[10**400, 0, 0]]), "points must be an array"),
    "complex": (lambda: mesh(points=POINTS + 1j), "points must be an array"),
    "flat list": (lambda: mesh(points=[1.0, 2.0, 3.0]), "shape (n, 3)"),
    "two columns": (lambda: mesh(points=POINTS[:, :2]), "shape (n, 3)"),
    "no points": (lambda: mesh(points=np.zeros((0, 3))), "point numbers"),
    "NaN": (lambda: mesh(points=moved(math.nan)), "points must be finite"),
    "infinite": (lambda: mesh(points=moved(math.inf)), "points must be finite"),
    "far": (lambda: mesh(points=moved(1e300)), "points must be finite, within 1e+30 m"),
    "large": (lambda: mesh(points=1e40 * POINTS), "within 1e+30 m"),
    "small": (lambda: mesh(points=1e-40 * POINTS), "span at least 1e-30 m"),
    "one place": (lambda: mesh(points=0.0 * POINTS), "span at least"),
    "flat body": (lambda: mesh(points=POINTS * [0, 1, 1]), "coincide"),
    "no bodies": (lambda: mesh(bodies=[]), "tetrahedra must not be empty"),
    "None bodies": (lambda: mesh(bodies=None), "tetrahedra must"),
    "ragged bodies": (lambda: mesh(bodies=[[0, 1, 2, 3], [0, 1]]), "rows of 4"),
    "real bodies": (lambda: mesh(bodies=BODIES.astype(float)), "integer point numbers"),
    "text bodies": (lambda: mesh(bodies=[["a", "b", "c", "d"]]), "integer point numbers"),
    "negative": (lambda: mesh(bodies=BODIES - 1), "point numbers must lie in [0, 4]"),
    "beyond": (lambda: mesh(bodies=BODIES + 1), "point numbers must lie in [0, 4]"),
    "far beyond": (lambda: mesh(bodies=BODIES.astype(np.int64) + 2**32), "must lie in [0, 4]"),
    "twice the body": (lambda: mesh(bodies=[*BODIES, BODIES[0]]), "same four points"),
    "point twice": (lambda: mesh(bodies=[[0, 0, 1, 2]]), "no volume"),
    "groups list": (lambda: mesh(groups=[1, 2]), "groups must be a dict"),
    "groups text": (lambda: mesh(groups="left"), "groups must be a dict"),
    "groups None": (lambda: mesh(groups=None), "groups must be a dict"),
    "group number": (lambda: mesh(groups={3: GROUPS["left"]}), "name of a group"),
    "group quote": (lambda: mesh(groups={'a"b': GROUPS["left"]}), "name of a group"),
    "group line": (lambda: mesh(groups={"a\nb": GROUPS["left"]}), "name of a group"),
    "group empty": (lambda: mesh(groups={"left": []}), "must not be empty"),
    "group ragged": (lambda: mesh(groups={"left": [[0, 1], [2]]}), "rows of 3"),
    "group half inside": (
        lambda: mesh(groups={"left": [[0, 1, 2], *PAIR.groups["left"]]}),
        "1 of its 4 faces are not outer faces",
    ),
    "weld edge": (lambda: mesh(weld_tolerance=1.0), "weld_tolerance must lie in"),
    "weld NaN": (lambda: mesh(weld_tolerance=math.nan), "weld_tolerance must lie in"),
    "weld huge": (lambda: mesh(weld_tolerance=10**400), "weld_tolerance must lie in"),
    "weld text": (lambda: mesh(weld_tolerance="1"), "weld_tolerance must lie in"),
    "too many boxes": (lambda: bar(1.0, 1.0, (10**6, 10**6, 10**6)), "cells must make at most"),
    "too thin": (lambda: single(1.0, 1e-30), "no volume"),
}


def scene(*listed, **options):
    """A scene of the pair."""
    return Scene(PAIR, CONCRETE, listed, **options)


def run(**options):
    """A run of the pair by the fastest method that there is to compile."""
    arguments = {"method": Uniform(), "until": 1e-7, **options}
    return simulate(arguments.pop("scene", scene()), **arguments)


JUMPY = StepControl(dashpot_floor=1e-9)
SCENES = {
    "mesh file": (lambda: Scene("block.msh", CONCRETE), "mesh must be a Mesh"),
    "material": (lambda: Scene(PAIR, {}), "material must be a Material"),
    "effects None": (lambda: Scene(PAIR, CONCRETE, None), "effects must be a list"),
    "effects number": (lambda: Scene(PAIR, CONCRETE, 3), "effects must be a list"),
    "effect class": (lambda: scene(effects.Gravity), "effects must be objects"),
    "effect alone": (lambda: Scene(PAIR, CONCRETE, effects.Gravity()), "effects must be a list"),
    "roles": (lambda: scene(effects.Softening(), effects.Softening()), "both take the role"),
    "no contact": (lambda: scene(effects.Friction()), "list SphereContact too"),
    "no notch": (lambda: scene(unbonded=["notch"]), "no face group 'notch'; its groups are:"),
    "no joint": (lambda: scene(weaker={"joint": 0.5}), "no face group 'joint'; its groups are:"),
    "joint of no name": (lambda: scene(weaker={3: 0.5}), "no face group 3; its groups are:"),
    "notch outside": (lambda: scene(unbonded=["left"]), "group left must be of inner faces"),
    "joint outside": (lambda: scene(weaker={"left": 0.5}), "group left must be of inner faces"),
    "notch and joint": (
        lambda: Scene(CUT, CONCRETE, unbonded=["notch"], weaker={"notch": 0.5}),
        "weaker must not have a group that is unbonded, got notch in both",
    ),
    "pressure inside": (
        lambda: Scene(CUT, CONCRETE, [effects.Pressure("notch", 1.0)]),
        "group notch must be of outer faces, or unbonded",
    ),
    "pressure on a weak joint": (
        lambda: Scene(CUT, CONCRETE, [effects.Pressure("notch", 1.0)], weaker={"notch": 0.5}),
        "group notch must be of outer faces, or unbonded",
    ),
    "quiet inside": (
        lambda: Scene(CUT, CONCRETE, [effects.QuietBoundary("notch")]),
        "group notch must be of outer faces, or unbonded",
    ),
    "quiet body alone": (
        lambda: run(scene=Scene(single(), CONCRETE, [effects.QuietBoundary("base")])),
        "p_speed of quiet_boundary must be given where no bond is near",
    ),
    "unequal histories": (lambda: effects.Pressure("left", [1, 2, 3], [0, 1]), "as many as times"),
    "times fall": (lambda: effects.Pressure("left", [1, 2], [1, 0]), "times must rise"),
    "times before 0": (lambda: effects.Pressure("left", [1, 2], [-1, 0]), "times must rise"),
    "no peak": (lambda: effects.Pressure.triangle("left", 0, 1, 1), "peak must be"),
    "ramp and history": (
        lambda: effects.PrescribedMotion("left", (1, 0, 0), ramp=1.0, history=([0], [1])),
        "ramp must be 0 where there is a history",
    ),
    "taken name": (lambda: with_cut(PAIR, "left", (0, 0, 0), (1, 0, 0)), "name must be that of"),
    "cut nowhere": (lambda: with_cut(PAIR, "cut", (9, 0, 0), (1, 0, 0)), "at least one face"),
    "cut no way": (lambda: with_cut(PAIR, "cut", (0, 0, 0), (0, 0, 0)), "normal must be longer"),
    "choice": (lambda: with_outer_group(PAIR, "cut", 3), "chosen must be a function"),
    "choices": (lambda: with_inner_group(PAIR, "cut", lambda x: x), "one truth value for each"),
    "no group": (lambda: scene(effects.GasPressure()), "no face group 'hole'"),
    "floor": (lambda: Uniform(control=JUMPY), "dashpot_floor must be 0 unless"),
    "sweeps": (lambda: ImplicitDashpots(sweeps=(5, 2)), "sweeps must be two whole numbers"),
    "zero normal": (lambda: effects.Roller("left", (0, 0, 0)), "longer than zero"),
    "scene None": (lambda: run(scene=None), "scene must be a Scene, got None"),
    "scene mesh": (lambda: run(scene=PAIR), "scene must be a Scene"),
    "method None": (lambda: run(method=None), "method must be"),
    "method class": (lambda: run(method=Multirate), "method must be"),
    "method text": (lambda: run(method="implicit"), "method must be"),
    "until": (lambda: run(until=math.nan), "until must be a positive"),
    "until far": (lambda: run(until=1e9), "until must be at most"),
    "until list": (lambda: run(until=[1e-8]), "until must be a positive"),
    "samples": (lambda: run(samples=10**12), "samples must be a whole number"),
    "samples real": (lambda: run(samples=2.0), "samples must be a whole number"),
    "frames": (lambda: run(frames=10**12), "frames must be a whole number"),
    "frames None": (lambda: run(frames=None), "frames must be a whole number"),
    "driver": (lambda: run(driver="mpi"), "driver must be one of auto"),
    "driver list": (lambda: run(driver=["auto"]), "driver must be one of auto"),
    "progress": (lambda: run(progress=3), "progress must be a function"),
    "output": (lambda: run(output=3), "output folder must be"),
    "checkpoint": (lambda: run(checkpoint="run.npz"), "checkpoint must be a Checkpoint"),
    "marks": (
        lambda: run(until=1.0, checkpoint=Checkpoint("run.npz", every_s=1e-8)),
        "every_s 1e-06 s in a run",
    ),
    "resume": (lambda: run(resume=3), "name of a file"),
    "resume none": (lambda: run(resume="none.npz"), "cannot read checkpoint none.npz"),
    "Simulation": (lambda: Simulation(None, Uniform()), "scene must be a Scene"),
    "Simulation method": (lambda: Simulation(scene(), 3), "method must be"),
    "Simulation driver": (lambda: Simulation(scene(), Uniform(), 3), "driver must be one of"),
    "quality": (lambda: quality_report(None, CONCRETE), "mesh must be a Mesh"),
    "quality material": (lambda: quality_report(PAIR, None), "material must be a Material"),
    "steps": (lambda: step_report(3), "must be a Scene"),
    "needs": (lambda: needed_effects(None), "result must be a Result"),
}


def table(**columns):
    """A table of two scenes of a fixed mass."""
    return SceneTable(**{"particles": [0, 1], "seed": 1, "dt": 1e-3, **columns})


def batch(**columns):
    """A batch of such a table."""
    return Batch(RigidMass(), table(**columns))


def response(**options):
    """A response of a fixed mass."""
    arguments = {"particles": 1, "ratios": [0.9, 1.0], "dt": 1e-3, **options}
    return frequency_response(arguments.pop("filling", RigidMass()), **arguments)


def swept(**options):
    """A sweep of a fixed mass."""
    return sweep_up_and_down(RigidMass(), **{"particles": 1, "ratios": 1.0, **options})


def solved(**options):
    """An answer about a fixed mass."""
    given = {"filling": RigidMass(), "particles": 1, "goal": goals.rms_at(1.0), **options}
    return solve_response(given.pop("filling"), **given)


def started():
    """A started batch."""
    made = batch()
    made.start()
    return made


DAMPERS = {
    "particles text": (lambda: table(particles="3"), "particles must be a number"),
    "particles half": (lambda: table(particles=[1.5, 2]), "particles must be whole"),
    "particles below": (lambda: table(particles=-1), "particles must be whole"),
    "particles NaN": (lambda: table(particles=math.nan), "particles must be whole"),
    "seed large": (lambda: table(seed=2**31), "seed must be whole"),
    "seed None": (lambda: table(seed=None), "seed must be a number"),
    "ragged": (lambda: table(dt=[[1e-3], [1e-3, 1e-3]]), "dt must be a number"),
    "matrix": (lambda: table(dt=np.ones((2, 2))), "dt must be a number"),
    "lengths": (lambda: table(dt=[1e-3] * 3), "one number or one a scene"),
    "no scene": (lambda: table(particles=[]), "one number or one a scene"),
    "dt": (lambda: batch(dt=math.nan), "dt must be"),
    "dt long": (lambda: batch(dt=1.0), "dt must lie in"),
    "frequency": (lambda: batch(frequency=0.0), "frequency must be"),
    "mass": (lambda: batch(mass=-1.0), "mass must be"),
    "stiffness": (lambda: batch(stiffness=math.inf), "stiffness must be"),
    "filling None": (lambda: Batch(None, table()), "filling must be"),
    "filling class": (lambda: Batch(Automaton, table()), "filling must be"),
    "no table": (lambda: Batch(RigidMass(), None), "table must be a SceneTable"),
    "empty": (lambda: Batch(Empty(), table()), "particles must be 0"),
    "too many": (lambda: Batch(RigidMass(), table(particles=10**6 + 1)), "from 0 to 1000000"),
    "automaton full": (lambda: Batch(Automaton(), table(particles=161)), "from 0 to 160"),
    "places": (
        lambda: Batch(Automaton(columns=61, rows=61), table(particles=np.zeros(9000, int))),
        "scenes x places for particles must be at most 33554432",
    ),
    "start": (lambda: batch().start("moving"), "start must be one of"),
    "start list": (lambda: batch().start([]), "start must be one of"),
    "no start": (lambda: batch().run(1, 1), "call start() first"),
    "cycles": (lambda: started().run(-1, 1), "transient_cycles must be"),
    "more cycles": (lambda: started().run(1, 2), "measured_cycles must be"),
    "steps": (lambda: started().advance(1.5), "steps must be whole numbers"),
    "steps lengths": (lambda: started().advance([1, 2, 3]), "one for all or 2"),
    "steps far": (lambda: started().advance(2**40), "steps must be whole numbers"),
    "drive": (lambda: started().drive("fast"), "frequency must be numbers"),
    "drive NaN": (lambda: started().drive(math.nan), "frequency must be"),
    "drive lengths": (lambda: started().drive([6.0] * 3), "one for all or 2"),
    "snapshot": (lambda: started().snapshot(2), "s must be a whole number from 0 to 1"),
    "film": (lambda: film(None, 10), "batch must be a Batch"),
    "film steps": (lambda: film(started(), 0), "steps must be a whole number"),
    "film samples": (lambda: film(started(), 2**30), "sample_every must be at least 1074"),
    "response filling": (lambda: response(filling=3), "filling must be"),
    "oscillator": (lambda: response(oscillator=3), "oscillator must be an Oscillator"),
    "stiff": (lambda: response(oscillator=Oscillator(stiffness=1e59)), "dt must lie in"),
    "ratios": (lambda: response(ratios="1"), "ratios must be"),
    "ratios None": (lambda: response(ratios=None), "ratios must be"),
    "ratios dict": (lambda: response(ratios={0.9: 1}), "ratios must be"),
    "descending": (lambda: response(ratios=[1.0, 0.9]), "ratios must ascend"),
    "seeds": (lambda: response(seeds="12"), "seeds must be"),
    "scenes": (lambda: response(seeds=10**6, particles=range(99)), "must make at most"),
    "transient": (lambda: response(transient_cycles=1.5), "transient_cycles must be"),
    "measured": (lambda: response(measured_cycles=0), "measured_cycles must be"),
    "progress": (lambda: response(progress="bar"), "progress must be a function"),
    "resume": (lambda: response(resume="none.npz"), "cannot read checkpoint"),
    "sweep start": (lambda: swept(start="moving"), "start must be one of"),
    "sweep transient": (lambda: swept(transient_cycles=None), "transient_cycles must be"),
    "needs": (lambda: damper_needs(3), "result must be a Response"),
    "tolerance": (lambda: solved(tolerance=0), "tolerance must be a share in (0, 1]"),
    "tolerance NaN": (lambda: solved(tolerance=math.nan), "tolerance must be a share"),
    "tolerance large": (lambda: solved(tolerance=1.5), "got 1.5"),
    "tolerance text": (lambda: solved(tolerance="1%"), "tolerance must be a share"),
    "confidence": (lambda: solved(confidence=1.0), "confidence must be a number from 0.5"),
    "goal": (lambda: solved(goal="peak"), "goal must be a Goal such as goals.peak_rms()"),
    "goal function": (lambda: solved(goal=goals.peak_rms), "goal must be a Goal"),
    "no goals": (lambda: solved(goal=[]), "a list of at least one, got none"),
    "goal of a list": (lambda: solved(goal=[3]), "goal must be a Goal"),
    "goal's shape": (
        lambda: solved(goal=goals.Goal("a", "1", "value", lambda found: 3.0, (1.0,))),
        "must return one value or one row for each of",
    ),
    "budget": (lambda: solved(budget_s=0), "budget_s must be a positive"),
    "budget NaN": (lambda: solved(budget_s=math.nan), "budget_s must be a positive"),
    "budget small": (lambda: solved(budget_s=1e-9), "budget_s must leave time for the pilot"),
    "range": (lambda: solved(ratios=(1.0, 0.9)), "two numbers (lowest, highest)"),
    "range of one": (lambda: solved(ratios=1.0), "two numbers (lowest, highest)"),
    "range NaN": (lambda: solved(ratios=(0.9, math.nan)), "two numbers (lowest, highest)"),
    "solved particles": (lambda: solved(particles=[1, 2]), "particles must be one whole number"),
    "solved seeds": (lambda: solved(seeds=0), "seeds must be"),
    "solved filling": (lambda: solved(filling=3), "filling must be"),
    "solved oscillator": (lambda: solved(oscillator=3), "oscillator must be an Oscillator"),
    "solved progress": (lambda: solved(progress="bar"), "progress must be a function"),
    "lattice": (lambda: Automaton(columns=4000, rows=4000), "fewer than 4096 cells"),
    "ledger": (lambda: Automaton(rules="paper", ledger=True), "ledger must be False"),
    "priority": (
        lambda: paper(pair_rule="one_sided", priority="pairs_first"),
        "priority must be 'random'",
    ),
    "cell": (lambda: Automaton(start=[(10, 0)]), "(0, 0) to (9, 15), got (10, 0)"),
    "cell twice": (lambda: Automaton(start=[(1, 1), (1, 1)]), "must not name a cell twice"),
    "cell text": (lambda: Automaton(start="ab"), "start must be a tuple"),
    "v_max": (lambda: Automaton().check(3, 1e-2), "dt must lie in (0, 0.0012) s"),
    "box": (lambda: Spheres(width=5e-3), "width must be at least the diameter"),
    "huge box": (lambda: Spheres(width=1e3, height=1e3), "at most 1000000 spheres"),
    "places shape": (lambda: Spheres(start=[(1, 2, 3)]), "two coordinates"),
    "places text": (lambda: Spheres(start="middle"), "two coordinates"),
    "places huge": (lambda: Spheres(start=[(10**400, 0)]), "two coordinates"),
    "places NaN": (lambda: Spheres(start=[(math.nan, 0.03)]), "off the walls"),
    "places wall": (lambda: Spheres(start=[(0.0, 0.03)]), "off the walls"),
    "overlap": (lambda: Spheres(start=[(0.03, 0.03), (0.031, 0.03)]), "overlap"),
    "span": (lambda: rk45.solve(lambda t, y: -y, "ab", [1.0]), "span must be two finite times"),
    "y0": (lambda: rk45.solve(lambda t, y: -y, (0, 1), ["a"]), "y0 must be finite numbers"),
    "NaN slope": (lambda: rk45.solve(lambda t, y: y * math.nan, (0, 1), [1.0]), "stuck at t = 0"),
}
CASES = {
    **{f"mesh: {name}": case for name, case in MESHES.items()},
    **{f"scene: {name}": case for name, case in SCENES.items()},
    **{f"damper: {name}": case for name, case in DAMPERS.items()},
}


def test_there_are_more_than_a_hundred_of_them():
    assert len({(name, words) for name, (_, words) in CASES.items()}) > 100


@pytest.mark.parametrize("name", CASES)
@pytest.mark.filterwarnings("error")
def test_what_cannot_be_meant_is_refused_in_a_sentence(name):
    call, words = CASES[name]
    assert_refused(call, words)


@steady
@given(
    data=st.data(),
    shape=st.sampled_from([(5, 3), (4, 3), (6, 3), (5, 2)]),
    most=st.integers(0, 6),
    count=st.integers(1, 4),
)
def test_any_small_mesh_is_built_or_refused(data, shape, most, count):
    """Coordinates and point numbers at random, most of which make no mesh."""
    numbers = st.floats(-2.0, 2.0) | st.sampled_from([0.0, 1.0, math.nan, math.inf, 1e200, 1e-200])
    points = [[data.draw(numbers) for _ in range(shape[1])] for _ in range(shape[0])]
    bodies = [[data.draw(st.integers(-1, most)) for _ in range(4)] for _ in range(count)]
    try:
        made = checked_mesh(points, bodies, {})
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert isinstance(made, Mesh)
        assert np.isfinite(step_report(made, CONCRETE).step_s).all()
