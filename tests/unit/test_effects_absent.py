"""An effect that a scene leaves out: no fields, no code, and a word where it was needed."""

import json
import os
import subprocess
import sys

import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.body_materials import MOST
from taichi_dem.engine.capacity import LEAST
from taichi_dem.measured_overhead import elastic_step_seconds
from taichi_dem.mesh.shapes import bar, pair
from tests.scenes import ROOT

#: Opening beyond the tensile strength [m].
PAST = 20e-6

_COUNT = """
import glob, json, os, re
from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.kit.allocation import field_bytes
from taichi_dem.mesh.shapes import pair
from taichi_dem.step.advance import Advance
import taichi as ti
from taichi.lang import impl
from taichi_dem.measured_overhead import ByHand

os.environ["TI_OFFLINE_CACHE"] = "0"
runtime.start(threads=1)
impl.current_cfg().print_kernel_llvm_ir_optimized = True

@ti.data_oriented
class Kernel:
    def __init__(self, advance):
        self.advance = advance
    @ti.kernel
    def bond(self):
        for _ in range(1):
            self.advance.bond(0)
    @ti.kernel
    def body(self):
        for _ in range(1):
            self.advance.body(0)

def instructions(kernel):
    for name in glob.glob("*.ll"):
        os.remove(name)
    kernel()
    text = "".join(open(name).read() for name in glob.glob("*.ll"))
    return len(re.findall(r"^  (?:%|store|br|ret|call)", text, re.M))

def counts(cls, *listed):
    before = field_bytes()
    sim = Simulation(Scene(pair(), CONCRETE, listed), Uniform())
    kernel = Kernel(cls(sim.tables, sim.state, sim.schedule, None))
    return {
        "bytes": field_bytes() - before,
        "bond": instructions(kernel.bond),
        "body": instructions(kernel.body),
    }

# Tables, state and schedule with room for n elastic, free bodies and b bonds, in the order of their
# making, after the anchor of the tree.
n, b, whole, wide = 1024, 2048, ti.i32, ti.i64
# Of laws, a row of numbers for each ordered pair of sixteen materials.
pairs = 16**2
model = [(1, 1, wide), (1, 1, whole), (1, 1, whole), (n, 1), (n, 1), (n, 1), (n, 9), (n, 9)]
model += [(b, 2, whole), (b, 9), (b, 2), (b, 1), (3 * b, 3), (3 * b, 3)]
model += [(4 * n, 1, whole), (4 * n, 1, whole), (n, 1, whole), (b, 1, whole)]
state = [(n, 3), (n, 4), (n, 9), (n, 3), (n, 3), (n, 3), (n, 1, whole), (n, 1, whole)]
state += [(n, 1, wide), (4 * n, 6), (b, 1, wide), (n, 1, wide), (pairs, 3), (b, 2, wide)]
state += [(n, 1), (n, 6), (n, 2)]
state += [(1, 1, wide), (1, 1, whole), (1, 1)]
# Of three active lists that of contacts has but one place.
due = [(k, 1, whole) for size in (n, b, 1) for k in (size, size, size, 22)]
clock = [(21, 1), *due, *[(1, 1, whole)] * 4, (2 * n + 2 * b + 1, 1, whole), (1, 1, whole)]
clock += [(6, 1, wide)]

def bytes_by_hand():
    before = field_bytes()
    made = []
    for size, width, *kind in (*model, *state, *clock):
        made.append(ti.Vector.field(width, kind[0] if kind else ti.f64, shape=size))
    made[0].fill(0)
    return field_bytes() - before

every = {e.name: e for e in (effects.BondDamping(), effects.Softening(), effects.ShearSlip())}
print(json.dumps({
    "composed": counts(Advance),
    "by hand": counts(ByHand),
    "all": counts(Advance, *every.values(), effects.Gravity()),
    "bytes by hand": bytes_by_hand(),
    **{name: counts(Advance, effect) for name, effect in every.items()},
}))
"""


@pytest.fixture(scope="module")
def count(tmp_path_factory):
    """Optimised LLVM instructions of a bond and of a body, and bytes of all fields, by scene."""
    folder = tmp_path_factory.mktemp("count")
    script = folder / "count.py"
    script.write_text(_COUNT)
    done = subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": ROOT},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("what", ["bond", "body"])
def test_a_step_without_effects_compiles_to_the_code_written_by_hand(count, what):
    """Optimised LLVM instructions: composed without effects = stripped by hand."""
    assert count["by hand"][what] < count["all"][what]
    assert count["composed"][what] == count["by hand"][what]


def test_both_steps_are_timed_in_turns():
    seconds = elastic_step_seconds(bar(0.1, 0.05, (3, 2, 2)), substeps=5, repeats=3)
    assert {name: len(found) for name, found in seconds.items()} == {"composed": 3, "by_hand": 3}
    assert min(map(min, seconds.values())) > 0.0


def test_a_scene_without_effects_allocates_what_is_listed_by_hand(count):
    assert count["composed"]["bytes"] == count["bytes by hand"]


@pytest.mark.parametrize(
    ("effect", "own"), [("bond_damping", (0, 2)), ("softening", (2, 6)), ("shear_slip", (2, 6))]
)
def test_an_effect_adds_its_own_fields_and_the_account_of_heat(count, effect, own):
    """own: numbers of the law by pair of materials, and of each bond beside three of heat."""
    law, bond = own
    room = 2 * LEAST.bodies
    assert count[effect]["bytes"] - count["composed"]["bytes"] == 8 * (
        MOST**2 * law + (bond + 3) * room
    )


OWNED = {"softening_unit": effects.Softening, "shear_slip": effects.ShearSlip}


@pytest.mark.parametrize("name", OWNED)
def test_an_absent_effect_owns_no_fields(name):
    """The state holds what the listed effects change, and nothing else."""
    rest = [other() for key, other in OWNED.items() if key != name]
    without = Simulation(Scene(pair(), CONCRETE, rest), Uniform())
    assert name not in without.state.fields()
    assert without.contacts is None and not hasattr(without.model, "sphere")
    listed = Simulation(Scene(pair(), CONCRETE, [OWNED[name]()]), Uniform())
    assert name in listed.state.fields()


def needs_after(listed, shift, broken=False):
    """What a run of one step misses when the slave starts displaced by shift in the face frame."""
    simulation = Simulation(Scene(pair(), CONCRETE, listed), Uniform(1e-9))
    frame = simulation.tables.bond_frame[0].to_numpy()
    place = simulation.model.centre.copy()
    place[1] += frame.T @ shift
    simulation.state.set_motion(place, [[1.0, 0, 0, 0]] * 2)
    if broken:
        simulation.state.broken_tick[0] = 0
    simulation.advance_to(1)
    simulation.missing_effects.sample(simulation.time_s)
    return simulation.report().needs


CASES = {
    "Softening": ([effects.ShearSlip], (PAST, 0.0, 0.0), False),
    "ShearSlip": ([effects.Softening], (0.0, 1e-4, 0.0), False),
    "SphereContact": ([effects.Softening, effects.ShearSlip], (-1e-5, 0.0, 0.0), True),
}


@pytest.mark.parametrize("missing", CASES)
def test_a_run_that_needed_an_absent_effect_says_so(missing):
    classes, shift, broken = CASES[missing]
    listed = [effects.BondDamping(), *(make() for make in classes)]
    found = needs_after(listed, shift, broken)
    # Bodies without contact are within each other, and so are their faces.
    assert len(found) == (2 if missing == "SphereContact" else 1)
    assert all(need.startswith(f"{missing} is left out") for need in found)
    assert "first bond 0 at " in found[0]


def test_a_run_that_stayed_below_the_limits_is_silent():
    assert needs_after([effects.BondDamping()], (1e-6, 1e-6, 0.0)) == ()
