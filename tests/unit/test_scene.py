"""What a user writes is checked once, in words: name, value, what is allowed."""

import math

import pytest

from taichi_dem import CONCRETE, InputError, Multirate, Scene, Uniform, effects, simulate
from taichi_dem.mesh_shapes import bar, pair

BAR = bar(0.2, 0.1, (2, 1, 1))


def gas(**options):
    """A scene with gas on the left end."""
    return Scene(BAR, CONCRETE, [effects.GasPressure(**{"group": "left", **options})])


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Scene("block.msh", CONCRETE), "mesh must be a Mesh"),
        (lambda: Scene(BAR, "concrete"), "material must be a Material"),
        (lambda: Scene(BAR, CONCRETE, ["softening"]), "'softening'"),
        (lambda: Scene(BAR, CONCRETE, [effects.Friction()]), "list SphereContact too"),
        (
            lambda: Scene(BAR, CONCRETE, [effects.Softening(), effects.Softening()]),
            "softening and softening",
        ),
        (lambda: Scene(BAR, CONCRETE, [effects.GasPressure("hole")]), "hole"),
        (lambda: Scene(BAR, CONCRETE, [effects.Fixed("nowhere")]), "nowhere"),
        (lambda: Scene(BAR, CONCRETE, max_speed=math.nan), "max_speed"),
        (lambda: gas(peak=-1.0), "peak"),
        (lambda: gas(rise=0.0), "rise"),
        (lambda: gas(decay_ratio=math.inf), "decay_ratio"),
        (lambda: effects.SphereContact(divisions=2), "divisions"),
        (lambda: effects.SphereContact(skin=0.0), "skin"),
        (lambda: effects.Gravity((0.0, math.nan, 0.0)), "acceleration"),
        (lambda: effects.Gravity(9.81), "acceleration"),
        (lambda: effects.Roller("left", (0.0, 0.0, 0.0)), "normal"),
        (lambda: effects.PrescribedMotion("left", (1.0, 0.0)), "velocity"),
        (lambda: Uniform(dt0=0.0), "dt0"),
        (lambda: Uniform(distance=-1e-8), "distance"),
        (lambda: Multirate(dt0=math.nan), "dt0"),
        (lambda: Multirate(neighbour="frozen"), "held, drifted"),
        (lambda: simulate(gas(), method=Uniform(), until=-1.0), "until"),
        (lambda: simulate(gas(), method=Uniform(), until=math.nan), "until"),
        (lambda: simulate(gas(), method=Uniform(), until=1e-7, samples=0), "samples"),
        (lambda: simulate(gas(), method=Uniform(), until=1e-7, frames=-1), "frames"),
        (lambda: simulate(gas(), method=Uniform(), until=1e-7, driver="mpi"), "'mpi'"),
        (lambda: simulate(gas(), method=Uniform(), until=1e-7, output="/dev/null/x"), "/dev/null"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(build, words):
    with pytest.raises(InputError) as caught:
        build()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_scene_knows_its_effects():
    scene = Scene(pair(), CONCRETE, [effects.Softening()])
    assert scene.has("softening")
    assert not scene.has("friction")
