"""Input that a scene, its effects or a run refuse: one sentence with name, value and range."""

from dataclasses import replace

import pytest

from taichi_dem import (
    CONCRETE,
    InputError,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.scene import scene_warnings

NAN = float("nan")
MESH = single()


def scene(*listed, **options):
    return Scene(MESH, CONCRETE, listed, **options)


REFUSED = {
    "mesh type": (lambda: Scene("block.msh", CONCRETE), "mesh must be a Mesh", "str"),
    "material type": (lambda: Scene(MESH, 2390.0), "material must be a Material", "float"),
    "no effect": (lambda: scene("gravity"), "effects must be objects", "'gravity'"),
    "effect class": (lambda: scene(effects.Gravity), "effects must be objects", "Gravity"),
    "role twice": (
        lambda: scene(effects.Softening(), effects.Softening()),
        "softening and softening",
        "tension",
    ),
    "friction alone": (lambda: scene(effects.Friction()), "friction", "SphereContact"),
    "no group": (lambda: scene(effects.GasPressure("hole")), "hole", "base"),
    "support group": (lambda: scene(effects.Fixed("wall")), "wall", "base"),
    "max_speed": (lambda: scene(max_speed=-1.0), "max_speed must be a positive", "-1.0"),
    "max_speed zero": (lambda: scene(max_speed=0.0), "max_speed must be a positive", "0.0"),
    "max_speed NaN": (lambda: scene(max_speed=NAN), "max_speed must be a positive", "nan"),
    "peak": (lambda: effects.GasPressure(peak=-5.0), "peak must be a positive", "-5.0"),
    "rise": (lambda: effects.GasPressure(rise=NAN), "rise must be a positive", "nan"),
    "ratio": (lambda: effects.GasPressure(decay_ratio="2"), "decay_ratio must be", "'2'"),
    "divisions": (lambda: effects.SphereContact(divisions=2), "from 3 to 20", "2"),
    "skin": (lambda: effects.SphereContact(skin=0.0), "skin must be a number from 1e-06", "0.0"),
    "normal": (lambda: effects.Roller("left", (0, 0, 0)), "normal must be", "(0, 0, 0)"),
    "gravity": (lambda: effects.Gravity((0, NAN, 0)), "acceleration must be three", "nan"),
    "velocity": (lambda: effects.PrescribedMotion("left", (1, 2)), "velocity must be", "(1, 2)"),
    "frequency": (
        lambda: effects.PrescribedMotion("left", (1, 0, 0), -1.0),
        "frequency must be zero or a positive",
        "-1.0",
    ),
    "density": (lambda: replace(CONCRETE, density=-1.0), "density must be", "-1.0"),
    "friction NaN": (lambda: replace(CONCRETE, friction=NAN), "friction must be", "nan"),
    "fracture energy": (
        lambda: replace(CONCRETE, fracture_energy=1.0),
        "fracture_energy must be larger than",
        "1.0",
    ),
    "dt0": (lambda: Uniform(dt0=0.0), "dt0 must be a positive", "0.0"),
    "distance": (lambda: Multirate(distance=-1e-8), "distance must be a positive", "-1e-08"),
    "neighbour": (lambda: Multirate(neighbour="moved"), "held, drifted", "'moved'"),
    "until": (lambda: simulate(scene(), method=Uniform(), until=0.0), "until must be", "0.0"),
    "until text": (lambda: simulate(scene(), method=Uniform(), until="1"), "until must be", "'1'"),
    "samples": (
        lambda: simulate(scene(), method=Uniform(), until=1e-8, samples=0),
        "samples must be a whole number of at least 1",
        "0",
    ),
    "driver": (
        lambda: Simulation(Scene(pair(), CONCRETE), Uniform(), "mpi"),
        "driver must be one of auto, resident, parallel",
        "'mpi'",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_input_is_named_with_its_value_and_range(case):
    build, what, value = REFUSED[case]
    with pytest.raises(InputError) as refusal:
        build()
    sentence = str(refusal.value)
    assert what in sentence and value in sentence
    assert "\n" not in sentence


def test_a_scene_takes_effects_in_any_iterable_and_knows_them():
    built = Scene(MESH, CONCRETE, (effect for effect in [effects.Gravity()]))
    assert built.has("gravity") and not built.has("softening")
    assert isinstance(built.effects, tuple)


def test_loads_and_supports_may_be_listed_many_times():
    listed = scene(
        effects.Gravity(), effects.Gravity(), effects.Fixed("base"), effects.Fixed("sides")
    )
    assert len(listed.effects) == 4


@pytest.mark.parametrize(
    ("friction", "damping", "told"),
    [(effects.Friction, 0.0, 1), (effects.Friction, 1.0, 0), (effects.StickingFriction, 0.0, 0)],
)
def test_friction_that_no_dashpot_carries_is_told_before_a_run(friction, damping, told):
    material = replace(CONCRETE, contact_damping=damping)
    made = Scene(pair(), material, [effects.SphereContact(), friction()])
    sentences = scene_warnings(made)
    assert len(sentences) == told
    assert all("never acts" in sentence for sentence in sentences)
