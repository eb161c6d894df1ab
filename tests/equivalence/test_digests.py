"""Results of all methods have the bits that they had before the last redesign.

``digests.json`` holds a digest of each run and of the tables it was computed from. Both are the
same on every processor (``kit/fixed_order.py``, ``kit/elementary.py``). A change that is meant to
change bits writes the file anew: ``python -m tests.equivalence.test_digests``.
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    StepControl,
    Uniform,
    runtime,
    simulate,
)
from taichi_dem import effects as listed
from taichi_dem.elasticity.rates import dashpots_of, springs_of, subset_rates
from taichi_dem.kit import ordered
from taichi_dem.kit.fixed_order import inverse
from taichi_dem.mesh.shapes import bar
from taichi_dem.state.model import Model
from taichi_dem.step.implicit import pairs
from tests.scenes import brisk_scene, paper_effects

STORED = Path(__file__).with_name("digests.json")
CONTROLLED = Multirate(8e-8, 1e-5, control=StepControl(dashpot_floor=1e-8), dashpot="limited")


def blown_bar(*more):
    """A bar of 72 bodies that is blown at one end, with all effects of the paper and more."""
    gas = listed.GasPressure("left", peak=2e9, rise=1e-5)
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [*paper_effects()[:-1], gas, *more])


def driven_bar():
    """The bar on a roller and a motion, with contact of its outer faces."""
    contact = listed.SphereContact(outer_faces=True, divisions=4)
    drive = listed.PrescribedMotion("right", (3.0, 0.0, 0.0), 2e4)
    held = [drive, listed.Roller("left", (1, 0, 0))]
    return Scene(
        bar(0.1, 0.05, (3, 2, 2)),
        CONCRETE,
        [*held, listed.BondDamping(), listed.Softening(), contact],
    )


#: Runs by name: scene, method, end [s], driver.
RUNS = {
    "held": (brisk_scene, Multirate(1e-8, 2e-7), 2.6e-5, "resident"),
    "held_parallel": (brisk_scene, Multirate(1e-8, 2e-7), 2.6e-5, "parallel"),
    "drifted": (brisk_scene, Multirate(1e-8, 2e-7, "drifted"), 2e-5, "resident"),
    "controlled": (brisk_scene, CONTROLLED, 3e-5, "resident"),
    "controlled_parallel": (brisk_scene, CONTROLLED, 3e-5, "parallel"),
    "implicit": (brisk_scene, ImplicitDashpots(4e-7), 6e-5, "resident"),
    "implicit_parallel": (brisk_scene, ImplicitDashpots(4e-7), 6e-5, "parallel"),
    "uniform": (brisk_scene, Uniform(2e-8), 2e-5, "resident"),
    "uniform_limited": (brisk_scene, Uniform(2.5e-8, dashpot="limited"), 2e-5, "resident"),
    "uniform_controlled": (brisk_scene, Uniform(4e-8, control=StepControl()), 2e-5, "resident"),
    "bar_controlled": (blown_bar, CONTROLLED, 8e-5, "resident"),
    "moved": (driven_bar, Multirate(1e-8, 1e-7), 4e-5, "resident"),
    "moved_implicit": (driven_bar, ImplicitDashpots(2e-7), 4e-5, "resident"),
}
QUICK = ("held", "controlled", "implicit", "bar_controlled")


def digest(arrays):
    """Sixteen letters that change with any bit."""
    made = hashlib.sha256()
    for array in arrays:
        made.update(np.ascontiguousarray(array).tobytes())
    return made.hexdigest()[:16]


def given(scene):
    """Tables that a run is computed from."""
    model = Model(scene.mesh, scene.material, scene.effects)
    shape = model.mesh, model.topology, model.material.density
    rates = [subset_rates(*shape, of(model.material)) for of in (dashpots_of, springs_of)]
    tables = (inverse(model.body_inertia), *model.bonds.values(), *rates)
    return digest((*tables, model.spheres.centre, model.spheres.radius))


def found(name):
    """Digests of the tables that a run is computed from, and of all that it gives."""
    make, method, until, driver = RUNS[name]
    scene = make()
    counted = {"samples": 4, "frames": 2, "progress": None}
    result = simulate(scene, method=method, until=until, driver=driver, **counted)
    # Forces and stresses are read off what is digested here, and were added later.
    keys = [key for key in result.series if not key.endswith("_N")]
    named = ((np.frombuffer(key.encode(), np.uint8), result.series[key]) for key in keys)
    arrays = [part for pair in sorted(named, key=lambda pair: pair[0].tobytes()) for part in pair]
    for frame in result.frames:
        arrays += [frame.position, frame.rotation, frame.velocity]
        arrays += [frame.level.astype(np.int64), frame.damage, frame.bound.astype(np.int64)]
    arrays += [np.nan_to_num(result.broken_time, nan=-1.0), result.peak_speed]
    return {"given": given(scene), "found": digest(arrays)}


# The paper's step is above the limit of the dashpots of spheres, which the run says.
@pytest.mark.filterwarnings("ignore:the step of .* stable for sure in contact")
@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in RUNS]
)
def test_a_run_has_the_bits_that_it_had(name):
    stored, now = json.loads(STORED.read_text())[name], found(name)
    assert now == stored


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("implicit_parallel", marks=pytest.mark.long),
        pytest.param("controlled_parallel", marks=pytest.mark.slow),
    ],
)
def test_chunks_of_one_member_change_no_bit(name, monkeypatch, compiled_anew):
    """Each phase a parallel loop over chunks; all contacts are coloured by what rounds leave."""
    monkeypatch.setattr(ordered, "_CPU", (1, 64))
    monkeypatch.setattr(ordered, "_SERIAL_UP_TO", 0)
    monkeypatch.setattr(pairs, "_ROUNDS", (0, 0))
    assert found(name) == json.loads(STORED.read_text())[name]


if __name__ == "__main__":
    runtime.start(threads=2)
    STORED.write_text(json.dumps({name: found(name) for name in RUNS}, indent=1) + "\n")
