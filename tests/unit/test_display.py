"""What a prompt shows of an object of either package: short, in words, without the device."""

import dataclasses
import importlib
import inspect
import pkgutil
import re

import numpy as np
import pytest

import ca_damper
import taichi_dem
from ca_damper import measures, rk45
from taichi_dem import CONCRETE, effects, methods, runtime
from taichi_dem.diagnostics.missing_effects import MissingEffect
from taichi_dem.effects.base import Effect
from taichi_dem.kit.accuracy.answer import Answer, ErrorParts, Expense, Plan
from taichi_dem.kit.display import counted, in_brief, listed
from taichi_dem.kit.sweeps.job import Job, Record
from taichi_dem.mesh.contact_spheres import spheres_of_faces
from taichi_dem.mesh.shapes import bar
from taichi_dem.stability.step_control import Displacement, FixedStep

PACKAGES = (taichi_dem, ca_damper)
MOST_LETTERS, MOST_LINES = 500, 3
#: Whose representation tells a checkpoint which run it is of, and so may not change.
IDENTIFYING = (
    CONCRETE,
    taichi_dem.Uniform(distance=1e-8),
    taichi_dem.Multirate(control=taichi_dem.StepControl()),
    taichi_dem.ImplicitDashpots(),
    taichi_dem.StepControl(),
    ca_damper.Automaton(),
    ca_damper.Spheres(),
    ca_damper.Combined(),
    ca_damper.RigidMass(),
    ca_damper.Empty(),
    ca_damper.Oscillator(),
)
#: Rules of the step, which methods use inside.
UNSHOWN = {Displacement, FixedStep}
EFFECTS = (
    *(effects.BondDamping(), effects.Softening(), effects.ShearSlip(), effects.SphereContact()),
    effects.FaceContact(),
    *(effects.Friction(), effects.StickingFriction(), effects.Gravity()),
    effects.SlipWeakening(1000.0),
    *(effects.GasPressure("left"), effects.Fixed("left"), effects.Pressure("left", 1e6)),
    effects.QuietBoundary("right"),
    effects.Roller("bottom", (0.0, 2.0, 0.0)),
    effects.PrescribedMotion("right", (1.0, 0.0, 0.0), 50.0),
)


def swept():
    """Table of a sweep of one row."""
    record = Record({"speed_m_s": 1.5}, "", True, 0.1, "1.0", "unknown", "machine")
    return taichi_dem.SweepTable(
        [Job({"mass": 2.0, "seed": 7}, "digest", {})], [record], seeded=False
    )


def of_the_blast():
    """All that a user holds after a run of the blast, and before."""
    mesh = bar(0.4, 0.1, (4, 1, 1))
    # Contacts apart, which take long to compile and would add nothing to be shown.
    others = ("contact", "friction")
    few = [e for e in EFFECTS if e.role not in others and e.name != "slip_weakening"]
    scene, method = taichi_dem.Scene(mesh, CONCRETE, few), taichi_dem.Uniform(1e-8)
    seen = taichi_dem.Receivers({"middle": (0.2, 0.05, 0.05)})
    run = {"until": 4e-8, "frames": 3, "samples": 4, "observers": [seen]}
    result = taichi_dem.simulate(scene, method=method, **run)
    yield from (seen, result.receivers["middle"], result.history, swept())
    yield from (mesh, scene, result, result.model, result.report, result.frames[0])
    yield from (result.model.topology, spheres_of_faces(mesh, result.model.centre, 5))
    simulation = taichi_dem.Simulation(scene, method)
    yield from (simulation, result.report.effect_activity[0])
    yield from (
        taichi_dem.needed_effects(result),
        MissingEffect("Softening", "bonds are stretched"),
    )
    yield from (taichi_dem.step_report(scene), taichi_dem.quality_report(mesh, CONCRETE))
    rock = taichi_dem.Material.from_elastic(
        young=32e9,
        poisson=0.2,
        density=2450.0,
        tensile_strength=5e6,
        fracture_energy=100.0,
        friction_angle=40.0,
        cohesion=1e7,
    )
    wanted = taichi_dem.Targets(young=2e10, poisson=0.25)
    report = taichi_dem.elastic_report(scene)
    yield from (rock, wanted, report, report.stiffness, taichi_dem.calibrate(mesh, rock, wanted))
    yield from (taichi_dem.Checkpoint("run.npz"), taichi_dem.Every(steps=10), taichi_dem.At([0.0]))
    yield taichi_dem.RunView(simulation, None)
    yield taichi_dem.Collector(taichi_dem.Every(steps=1), time_s=lambda view: view.time_s)


def of_the_damper():
    """All that a user holds of the damper."""
    few = {"particles": [0, 10], "ratios": np.linspace(0.9, 1.1, 5), "seeds": 2}
    few.update(transient_cycles=0, measured_cycles=2, start="rigid")
    response = ca_damper.frequency_response(ca_damper.RigidMass(), **few)
    yield ca_damper.frequency_response(
        ca_damper.RigidMass(), **{**few, "base_amplitude": [1e-4, 2e-4]}
    )
    batch = ca_damper.Batch(ca_damper.RigidMass(), ca_damper.SceneTable([1, 2], 1, 1e-4))
    batch.start()
    film = ca_damper.film(batch, 10, frame_every=5)
    cycles = measures.Cycles(np.ones(2), np.ones(2), np.zeros((2, 1, len(measures.COLUMNS))))
    yield from (response, response.report, ca_damper.Sweep(response, response), batch, batch.table)
    few = {"amplitudes": 1e-3, "frequencies": 6.0, "particles": 1, "seeds": 1}
    yield ca_damper.damper_map(ca_damper.RigidMass(), **few)
    yield ca_damper.collect_and_collide(1.0, 2.0)
    yield ca_damper.ImpactDamper(ca_damper.Oscillator(), 0.01, 0.5, 0.012, 6.0)
    motion = ca_damper.excitation.sines([5.0, 7.0], 1e-3, 0.1)
    force = ca_damper.excitation.SineForce(1.0, 5.0)
    yield from (motion, force, ca_damper.excitation.Excitation(motion, force))
    yield ca_damper.shake(ca_damper.RigidMass(), motion, particles=1, seeds=1)
    storeys, box = ca_damper.ModalStructure.from_matrices([1.0], [[1e3]], 0.01), ca_damper.Box(0, 1)
    yield from (storeys, box)
    yield ca_damper.shake_structure(ca_damper.RigidMass(), storeys, box, motion, seeds=1)
    yield from (film, film.frames[0][0], cycles, ca_damper.needed_effects(response))
    yield from (rk45.solve(lambda t, y: -y, (0.0, 1.0), [1.0]), ca_damper.Progress(0.5, 1.0))
    yield from (ca_damper.ProgressBar("work"), response.report.certificate)


def of_questions():
    """Goals, and answers of both packages."""
    parts, plan = ErrorParts(step=0.01), Plan("solved dashpots", 3, 0.1, 0.2)
    cost = (Expense(0.01, 0.3, True), Expense(0.001, 1.0, False))
    answer = Answer("way", "mm", 1.0, parts, 0.01, 0.95, plan, cost_curve=cost)
    branch = ca_damper.Branch(1.0, 0.1, 0.75, 0.2, (1, 2, 3))
    yield from (answer, parts, plan, *cost, branch)
    yield ca_damper.BranchedAnswer(**{**vars(answer), "branches": (branch, branch)})
    yield from (taichi_dem.goals.hole_displacement(), ca_damper.goals.peak_rms())


@pytest.fixture(scope="module")
def held():
    """Objects that a user may hold; their session has ended, so that no field can be read."""
    made = (*IDENTIFYING, *EFFECTS, *of_the_blast(), *of_the_damper(), *of_questions())
    runtime.stop()
    return made


def test_what_a_user_holds_is_shown_in_a_few_words(held):
    for thing in held:
        text = repr(thing)
        assert type(thing).__name__ in text
        assert len(text) <= MOST_LETTERS and text.count("\n") < MOST_LINES, text
        assert not re.search(r"array\(|<ti\.| at 0x|nan", text), text


def is_ours(thing):
    """Whether a class, or that of an object, is one of the packages."""
    kind = thing if inspect.isclass(thing) else type(thing)
    return kind.__module__.partition(".")[0] in ("taichi_dem", "ca_damper")


def test_what_can_be_reached_from_it_is_no_longer(held):
    """Parts of parts too: whoever looks into an object gets lost in no page of numbers."""
    waiting, seen = list(held), {}
    while waiting:
        thing = waiting.pop()
        if id(thing) in seen or not is_ours(thing):
            continue
        seen[id(thing)] = thing
        assert len(repr(thing)) <= MOST_LETTERS, type(thing)
        for value in vars(thing).values() if hasattr(thing, "__dict__") else ():
            waiting += value if isinstance(value, (list, tuple)) else [value]
    assert len(seen) > len(held) + 20


def test_every_public_class_is_among_those_tried(held):
    """Errors apart, which Python shows."""
    public = [getattr(space, name) for space in (*PACKAGES, effects) for name in space.__all__]
    public += [kind for kind in vars(methods).values() if is_ours(kind)]
    public = [kind for kind in public if not getattr(kind, "_is_protocol", False)]
    classes = {kind for kind in public if inspect.isclass(kind) and is_ours(kind)}
    plain = {kind for kind in classes if not issubclass(kind, Exception)}
    assert plain - UNSHOWN <= set(map(type, held))
    assert len(plain) > 25


def modules_of(package):
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if not found.name.endswith("__main__"):
            yield importlib.import_module(found.name)


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_no_dataclass_shows_its_arrays(package):
    """One that holds arrays or dicts has a representation of its own, not Python's."""
    for module in modules_of(package):
        for kind in vars(module).values():
            if inspect.isclass(kind) and dataclasses.is_dataclass(kind):
                kinds = [str(field.type) for field in dataclasses.fields(kind)]
                holds = any(re.search("ndarray|dict", text) for text in kinds)
                # Python's own is wrapped, against dataclasses that hold themselves.
                assert not (holds and hasattr(kind.__repr__, "__wrapped__")), kind


@pytest.mark.parametrize("thing", IDENTIFYING, ids=lambda thing: type(thing).__name__)
def test_what_identifies_a_run_is_shown_in_full(thing):
    """Evaluated, it is the object again: checkpoints compare it letter by letter."""
    space = {**vars(taichi_dem), **vars(ca_damper)}
    assert eval(repr(thing), space) == thing


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_an_effect_is_shown_as_the_call_that_made_it(effect):
    made = eval(repr(effect), vars(effects))
    assert type(made) is type(effect)
    assert {k: str(v) for k, v in vars(made).items()} == {
        k: str(v) for k, v in vars(effect).items()
    }


def test_a_bound_effect_is_shown_as_before(held):
    """Its fields, which binding adds, are not."""
    scene = next(thing for thing in held if isinstance(thing, taichi_dem.Scene))
    model = next(thing for thing in held if type(thing).__name__ == "Model")
    bound = {effect.name: repr(effect) for effect in model.effects if effect.name}
    assert {effect.name: repr(effect) for effect in scene.effects} == bound


def test_what_binding_put_in_the_place_of_an_argument_is_left_out():
    class Drag(Effect):
        def __init__(self, rate, group):
            self.rate, self.group = object(), group

    assert repr(Drag(1.0, "left")) == "Drag(group='left')"


def test_long_words_are_cut():
    mesh = bar(0.2, 0.1, (2, 1, 1))
    many = {f"group {k}": mesh.groups["left"] for k in range(1000)}
    text = repr(dataclasses.replace(mesh, groups=many, source="x" * 5000))
    assert text.startswith("<Mesh: 12 bodies, 12 points, groups group 0") and text.endswith("...>")
    assert len(text) <= MOST_LETTERS


def test_words_of_numbers():
    assert in_brief([], "", "one", "", "two") == "<list: one, two>"
    assert [counted(n, "body") for n in (0, 1, 1234)] == ["0 bodies", "1 body", "1,234 bodies"]
    assert listed((0.9, 1.0)) == "0.9, 1" and listed(range(10, 50)) == "10 to 49 (40 values)"
