"""What effects="auto" cannot take as words, sleep, loads and laws, and what it can."""

import math
from dataclasses import replace

import pytest

from taichi_dem import CONCRETE, Scene, effects
from taichi_dem.mesh.shapes import pair
from tests.bad_input.refusals import assert_refused

PAIR = pair()


def scene(*listed, **options):
    """A scene of the pair with a list of effects."""
    return Scene(PAIR, CONCRETE, listed, **options)


class Unsaid(effects.SphereContact):
    """A contact law that does not say when it begins to act."""

    def normal(self, m, overlap, opening_rate):
        """No force [N]."""
        return 0.0


class UnsaidFriction(effects.Friction):
    """A law of friction likewise."""

    def limit(self, m, force_normal):
        """No friction [N]."""
        return 0.0


class UnsaidTension(effects.Softening):
    """A normal law likewise."""

    def traction(self, m, stiffness, u, opening):
        """No traction [Pa]."""
        return 0.0


class UnsaidShear(effects.SlipWeakening):
    """A shear law likewise."""

    def failed(self, m, u, pressure):
        """It never fails."""
        return 0


class UnsaidDashpot(effects.BondDamping):
    """A dashpot likewise."""

    def traction(self, b, velocity):
        """No traction [Pa]."""
        return velocity


class WordsAlone(effects.Softening):
    """A normal law that says in words alone when it begins."""

    activation = "never"

    def traction(self, m, stiffness, u, opening):
        """No traction [Pa]."""
        return 0.0


class NoWords(effects.Softening):
    """Words that are none."""

    activation = 3


class NoFunction(effects.Softening):
    """A beginning that is no function."""

    begins = 3


def on_demand(*loads, **options):
    """A scene of the pair with effects on demand."""
    return Scene(PAIR, CONCRETE, "auto", loads=loads, **options)


SAY, SLEEP = "must have laws that say when they begin to act: ", "sleep must be a number from 0 to"
ON_DEMAND = {
    "word": (lambda: Scene(PAIR, CONCRETE, "most"), "one of 'auto', 'all', got 'most'"),
    "no word": (lambda: Scene(PAIR, CONCRETE, ""), "one of 'auto', 'all', got ''"),
    "upper case": (lambda: Scene(PAIR, CONCRETE, "Auto"), "one of 'auto', 'all', got 'Auto'"),
    "listed word": (lambda: Scene(PAIR, CONCRETE, ["auto"]), "must be objects from"),
    "sleep below": (lambda: on_demand(sleep=-1e-9), f"{SLEEP} 0.01, got -1e-09"),
    "sleep above": (lambda: on_demand(sleep=0.0101), f"{SLEEP} 0.01, got 0.0101"),
    "sleep NaN": (lambda: on_demand(sleep=math.nan), f"{SLEEP} 0.01, got nan"),
    "sleep infinite": (lambda: on_demand(sleep=math.inf), f"{SLEEP} 0.01, got inf"),
    "sleep text": (lambda: on_demand(sleep="1e-6"), f"{SLEEP} 0.01, got '1e-6'"),
    "sleep flag": (lambda: on_demand(sleep=True), f"{SLEEP} 0.01, got True"),
    "sleep of a list": (lambda: scene(sleep=1e-6), "sleep must be 0 unless effects is 'auto', got"),
    "NaN of a list": (lambda: scene(sleep=math.nan), f"{SLEEP} 0.01, got nan"),
    "sleep of all": (
        lambda: Scene(PAIR, CONCRETE, "all", sleep=1e-3),
        "sleep must be 0 unless effects is 'auto', got 0.001",
    ),
    "loads of a list": (lambda: scene(loads=[effects.Gravity()]), "loads must be left out where"),
    "loads of its effects": (
        lambda: replace(scene(), loads=[effects.Gravity()]),
        "loads must be left out where",
    ),
    "loads None": (lambda: replace(on_demand(), loads=None), "loads must be a list of effects"),
    "loads text": (lambda: replace(on_demand(), loads="gas"), "loads must be a list of effects"),
    "load alone": (lambda: replace(on_demand(), loads=effects.Gravity()), "loads must be a list"),
    "load class": (lambda: on_demand(effects.Gravity), "must be objects from taichi_dem.effects"),
    "load number": (lambda: on_demand(3), "must be objects from taichi_dem.effects, got 3"),
    "load group": (lambda: on_demand(effects.GasPressure()), "no face group 'hole'"),
    "law twice": (
        lambda: on_demand(effects.Softening(), effects.Softening()),
        "effects softening and softening both take the role tension",
    ),
    "two laws": (
        lambda: on_demand(effects.ShearSlip(), effects.SlipWeakening(1e3)),
        "effects shear_slip and slip_weakening both take the role shear",
    ),
    "silent law": (
        lambda: on_demand(effects.Softening().silent()),
        "must have laws of bonds that act, as it looks for no limit beside theirs, got a silent "
        "softening",
    ),
    "contact": (lambda: on_demand(Unsaid()), f"{SAY}Unsaid has no activation of its own"),
    "friction": (lambda: on_demand(UnsaidFriction()), f"{SAY}UnsaidFriction has no activation"),
    "tension": (lambda: on_demand(UnsaidTension()), f"{SAY}UnsaidTension has no activation"),
    "shear": (lambda: on_demand(UnsaidShear(1e3)), f"{SAY}UnsaidShear has no activation"),
    "dashpot": (lambda: on_demand(UnsaidDashpot()), f"{SAY}UnsaidDashpot has no activation"),
    "words alone": (lambda: on_demand(WordsAlone()), f"{SAY}WordsAlone has no begins of its own"),
    "no words": (lambda: on_demand(NoWords()), f"{SAY}NoWords has no activation of its own"),
    "no function": (lambda: on_demand(NoFunction()), f"{SAY}NoFunction has no begins of its own"),
}


@pytest.mark.parametrize("name", ON_DEMAND)
@pytest.mark.filterwarnings("error")
def test_what_cannot_be_meant_is_refused_in_a_sentence(name):
    call, words = ON_DEMAND[name]
    assert_refused(call, words)


class Firmer(effects.Softening):
    """A law that changes no traction needs no words of its own."""

    def numbers(self, material):
        """Twice as strong."""
        strength, opening = super().numbers(material)
        return 2.0 * strength, opening


@pytest.mark.parametrize(
    "law", [effects.FaceContact(), effects.StickingFriction(), effects.SlipWeakening(1e3), Firmer()]
)
def test_laws_of_the_package_and_of_their_numbers_are_taken(law):
    made = on_demand(law)
    assert made.effect(law.role) is law
    assert len(made.effects) == 5


def test_a_material_without_contact_damping_is_taken():
    """Its friction needs springs, and says when it begins to act."""
    made = Scene(PAIR, replace(CONCRETE, contact_damping=0.0), "auto")
    assert isinstance(made.effect("friction"), effects.StickingFriction)


def test_a_scene_that_is_changed_keeps_its_loads():
    """The certificate may send a user from auto to all."""
    made = on_demand(effects.Gravity(), effects.FaceContact())
    every = replace(made, effects="all", sleep=0.0)
    assert [effect.name for effect in every.effects] == [effect.name for effect in made.effects]
    stronger = replace(made, material=replace(CONCRETE, cohesion=1e7))
    assert tuple(stronger.effects) == tuple(made.effects) and stronger.on_demand
    assert tuple(replace(made, sleep=0.0).effects) == tuple(made.effects)
    assert_refused(lambda: replace(made, effects=[], sleep=0.0), "loads must be left out")
    assert Scene(PAIR, CONCRETE, "auto", loads=iter([effects.Gravity()])).has("gravity")
