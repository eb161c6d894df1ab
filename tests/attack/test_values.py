"""Values: numbers of any type are numbers, nothing else is, and what was checked stays checked."""

import copy
import dataclasses
import inspect
import pickle
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from ca_damper import Automaton, Oscillator, SceneTable, Spheres
from ca_damper.fixed_mass import RigidMass
from taichi_dem import (
    CONCRETE,
    At,
    Checkpoint,
    Every,
    ImplicitDashpots,
    InputError,
    Material,
    Multirate,
    Scene,
    SimulationDiverged,
    StepControl,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.effects.base import Effect
from taichi_dem.kit.checkpoint import identity_of
from taichi_dem.mesh.shapes import pair

ATTACKS = "values: types of numbers, changes after the check, copies"

#: Values, none of them a number, or none that could be meant.
STRANGE = (
    *(None, True, np.True_, "1", b"1", Decimal(1), 1j, object(), [], {}, (1.0,), [[1.0]], print),
    *(np.array([1.0]), np.array("1"), np.datetime64("2020"), lambda: 1.0),
    *(float("nan"), np.float32("inf"), -np.inf, 10**400, -(10**400), np.longdouble("1e400")),
)
#: Classes whose options are checked, with options that have no default or limit each other.
CHECKED = {
    Material: {field.name: getattr(CONCRETE, field.name) for field in dataclasses.fields(CONCRETE)},
    Uniform: {"dt0": 1e-8, "distance": 1e-8},
    Multirate: {"dt0": 1e-8, "distance": 1e-8},
    ImplicitDashpots: {"dt": 1e-7, "tolerance": 0.05, "theta": 0.75, "refresh": 3e-5},
    StepControl: {"safety": 0.5, "angle": 0.5, "ahead": 2.0},
    Automaton: {"restitution": 0.5, "particle_mass": 1e-3, "gravity": 9.8, "v_max": 1.0},
    Spheres: {"restitution": 0.5, "young": 1e9, "poisson": 0.25, "friction": 0.5, "height": 0.1},
    RigidMass: {"particle_mass": 1e-3, "gravity": 9.8},
    Oscillator: {"mass": 0.1, "stiffness": 100.0, "damping": 0.1},
    effects.GasPressure: {"peak": 1e6, "rise": 1e-4, "decay_ratio": 2.5},
    effects.SphereContact: {"divisions": 5, "skin": 1e-3, "pairs_per_body": 24},
    Every: {"time_s": 0.5},
    Checkpoint: {"path": "run.npz", "every_s": 0.5},
}
SEQUENCES = {
    effects.Gravity: "acceleration",
    effects.Roller: "normal",
    effects.PrescribedMotion: "velocity",
    At: "times_s",
}


def types_of(number, rng):
    """The same number in other types."""
    if isinstance(number, int):
        kinds = (np.int64, np.int32, np.uint16)
    else:
        kinds = (np.float64, Fraction)
        if float(np.float32(number)) == number:
            kinds += (np.float32,)
    return [kind(number) for kind in rng.permutation(np.array(kinds, dtype=object))]


def drawn(rng, number):
    """A number near another, often one that 24 bits hold."""
    if isinstance(number, int):
        return number
    near = number * rng.uniform(0.9, 1.0)
    return float(np.float32(near)) if rng.random() < 0.5 else float(near)


@pytest.mark.parametrize("kind", CHECKED, ids=lambda kind: kind.__name__)
def test_a_number_is_the_same_in_any_type(kind, seed):
    """Same identity in a checkpoint, and no calculation in fewer bits."""
    rng = np.random.default_rng(seed)
    options = dict(CHECKED[kind])
    numbers = {name: drawn(rng, x) for name, x in options.items() if isinstance(x, (int, float))}
    first = kind(**{**options, **numbers})
    for name, number in numbers.items():
        for other in types_of(number, rng):
            made = kind(**{**options, **numbers, name: other})
            assert identity_of(vars(made)) == identity_of(vars(first))
            assert repr(made) == repr(first)
            kept = vars(made).get(name)
            assert type(kept) in (int, float), (name, other)


@pytest.mark.parametrize("kind", CHECKED, ids=lambda kind: kind.__name__)
def test_what_is_no_number_is_refused_in_words(kind, seed):
    rng = np.random.default_rng(seed)
    options = CHECKED[kind]
    optional = {name for name, one in inspect.signature(kind).parameters.items() if not one.default}
    for name, number in options.items():
        for strange in rng.permutation(np.array([*STRANGE, None], dtype=object)[:-1])[:8]:
            if isinstance(number, str) or (strange is None and name in optional):
                continue
            with pytest.raises(InputError) as refused:
                kind(**{**options, name: strange})
            assert str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("kind", SEQUENCES, ids=lambda kind: kind.__name__)
def test_a_sequence_is_kept_as_it_was_given(kind, seed):
    """Lists, arrays of any type and generators alike; the caller's may change afterwards."""
    rng = np.random.default_rng(seed)
    numbers = rng.integers(1, 100, 3).astype(float)
    name, group = SEQUENCES[kind], {} if kind in (effects.Gravity, At) else {"group": "left"}
    first = kind(**group, **{name: numbers.tolist()})
    for given in (numbers.copy(), numbers.astype(np.float32), numbers.astype(int), list(numbers)):
        made = kind(**group, **{name: given})
        given[0] = -1.0
        assert identity_of(vars(made)) == identity_of(vars(first))
    made = kind(**group, **{name: (number for number in numbers)})
    assert identity_of(vars(made)) == identity_of(vars(first))
    for strange in (STRANGE[rng.integers(len(STRANGE))], numbers[:2] * np.nan, 1j * numbers):
        with pytest.raises(InputError):
            kind(**group, **{name: [1.0, strange, 2.0]})


ARGUMENTS = {
    "Fixed": ("a",),
    "Pressure": ("a", 1e6),
    "QuietBoundary": ("a",),
    "Roller": ("a", (1, 0, 0)),
    "SlipWeakening": (1000.0,),
}
SHIPPED = [
    getattr(effects, name)(*ARGUMENTS.get(name, ()))
    for name in effects.__all__
    if name != "PrescribedMotion"
]


@pytest.mark.parametrize("effect", SHIPPED, ids=lambda effect: effect.name)
def test_an_effect_refuses_every_change(effect, seed):
    """Its attributes, new ones, the elements of its arrays; copies and pickles are sealed too."""
    rng = np.random.default_rng(seed)
    twins = effect, copy.copy(effect), copy.deepcopy(effect), pickle.loads(pickle.dumps(effect))
    for one in twins:
        before = identity_of(vars(one))
        for name in (*vars(one), "role", "name", "anything"):
            with pytest.raises(InputError, match=f"make a new {type(effect).__name__}"):
                setattr(one, name, rng.random())
            with pytest.raises((InputError, AttributeError)):
                delattr(one, name)
        for value in vars(one).values():
            if isinstance(value, np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    value[0] = 7.0
        assert identity_of(vars(one)) == before == identity_of(vars(effect))
    if type(effect).harmless is not Effect.harmless:
        assert effect.silent().name == "" and effect.name


class Mine(effects.Gravity):
    """An effect of a user's own, with attributes set before and after those of its base."""

    def __init__(self, values):
        self.before = values
        super().__init__()
        self.after = {"values": values}


def test_an_effect_of_ones_own_is_sealed_when_it_is_complete(seed):
    values = np.random.default_rng(seed).random(4)
    effect = Mine(values)
    assert np.array_equal(effect.before, values) and effect.before is not values
    values[0] = 5.0
    assert effect.before[0] != 5.0
    with pytest.raises(InputError, match="make a new Mine"):
        effect.after = None


def test_a_class_of_effects_shows_the_options_of_its_constructor():
    assert list(inspect.signature(effects.GasPressure).parameters) == [
        *("group", "peak", "rise", "decay_ratio", "start")
    ]
    assert not inspect.signature(effects.Softening).parameters


@pytest.mark.parametrize("kind", [k for k in CHECKED if dataclasses.is_dataclass(k)])
def test_replace_checks_like_the_constructor(kind, seed):
    rng = np.random.default_rng(seed)
    options = CHECKED[kind]
    made = kind(**options)
    for name, number in options.items():
        value = STRANGE[rng.integers(1, len(STRANGE))] if rng.random() < 0.5 else number
        if isinstance(number, str):
            continue
        outcomes = []
        for call in (
            lambda name=name, value=value: dataclasses.replace(made, **{name: value}),
            lambda name=name, value=value: kind(**{**options, name: value}),
        ):
            try:
                outcomes.append(repr(call()))
            except InputError as error:
                outcomes.append(str(error))
        assert outcomes[0] == outcomes[1]


def test_a_table_changes_to_what_its_constructor_takes_and_to_nothing_else(seed):
    rng = np.random.default_rng(seed)
    start = {"particles": [3, 5], "seed": 1, "dt": 1e-4, "frequency": [5.0, 6.0]}
    choices = (*STRANGE, 4, np.int32(4), 2.5, np.float32(0.1), -1, [1, 2], (1.5, 2.5), [1, 2, 3])
    table = SceneTable(**start)
    for _ in range(40):
        name = str(rng.choice(SceneTable.COLUMNS))
        value = choices[rng.integers(len(choices))]
        numbers = {column: table.column(column) for column in SceneTable.COLUMNS}
        try:
            wanted = SceneTable(**{**numbers, name: value})
        except InputError:
            wanted = None
        if wanted is None or wanted.count != 2:
            with pytest.raises(InputError):
                table.change(**{name: value})
            wanted = SceneTable(**numbers)
        else:
            table.change(**{name: value})
        for column in SceneTable.COLUMNS:
            kept = table.column(column)
            assert kept.dtype in (np.int64, np.float64)
            assert kept.tobytes() == wanted.column(column).tobytes()
            with pytest.raises(ValueError, match="read-only"):
                kept[0] = -1
    with pytest.raises(InputError, match="number to change"):
        table.change(mess=1.0)


def test_scenes_and_results_survive_a_copy_and_a_pickle(seed):
    acceleration = np.random.default_rng(seed).random(3)
    scene = Scene(pair(), CONCRETE, [effects.Gravity(acceleration)])
    looks = {"until": 5e-8, "progress": None, "frames": 1, "samples": 2}
    result = simulate(scene, method=Uniform(1e-8), **looks)
    for way in (copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))):
        again = simulate(way(scene), method=way(Uniform(1e-8)), **looks)
        for other in (again, way(result)):
            assert other.frames[-1].position.tobytes() == result.frames[-1].position.tobytes()
            assert other.history["kinetic_J"].tobytes() == result.history["kinetic_J"].tobytes()
        failed = SimulationDiverged("too fast")
        failed.result = result
        assert str(way(failed)) == "too fast" and repr(way(failed).result) == repr(result)
        assert str(way(InputError("no"))) == "no"


@pytest.mark.parametrize("listed", [{effects.Gravity()}, frozenset(), "gravity", None, 5])
def test_effects_of_a_scene_come_in_an_order(listed):
    with pytest.raises(InputError, match="effects must be"):
        Scene(pair(), CONCRETE, listed)
