"""An effect that a scene leaves out: no fields, no code, and a word where it was needed."""

import json
import os
import subprocess
import sys

import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.mesh_shapes import pair
from tests.scenes import ROOT

#: Opening beyond the tensile strength [m].
PAST = 20e-6

_COUNT = """
import glob, json, os, re
import taichi as ti
from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.mesh_shapes import pair
from taichi_dem.physics.bond import unit_arm, unit_opening, unit_velocity
from taichi_dem.physics.rotation import zero3
from taichi_dem.step.advance import Advance
from taichi_dem.types import vec3

os.environ["TI_OFFLINE_CACHE"] = "0"
os.environ["TI_PRINT_KERNEL_LLVM_IR_OPTIMIZED"] = "1"
runtime.start(threads=1)

@ti.data_oriented
class ByHand(Advance):
    @ti.func
    def bond(self, b):
        if self.state.broken_tick[b] < 0:
            slots = self.model.bond_slots[b]
            motion = self._motion(b, slots)
            force, torque = zero3(), zero3()
            for q in range(3):
                u = 3 * b + q
                arm = unit_arm(motion, self.model.vertex_slave[u])
                opening = unit_opening(motion, arm, self.model.vertex_master[u])
                k = self.model.bond_stiffness[b]
                traction = vec3(k[0] * opening[0], k[1] * opening[1], k[1] * opening[2])
                force += traction
                torque += arm.cross(traction)
            dt = self.schedule.pair_step(slots[0] >> 2, slots[1] >> 2)
            area = self.model.unit_area[b]
            self._pull_together(slots, motion, force * (area * dt), torque * (area * dt))

@ti.data_oriented
class Kernel:
    def __init__(self, advance):
        self.advance = advance
    @ti.kernel
    def evaluate(self):
        for _ in range(1):
            self.advance.bond(0)

def instructions(advance):
    for name in glob.glob("*.ll"):
        os.remove(name)
    Kernel(advance).evaluate()
    text = "".join(open(name).read() for name in glob.glob("*.ll"))
    return len(re.findall(r"^  (?:%|store|br|ret|call)", text, re.M))

def advance_of(cls, listed):
    sim = Simulation(Scene(pair(), CONCRETE, listed), Uniform())
    return cls(sim.model, sim.state, sim.schedule, None)

every = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
print(json.dumps({
    "composed": instructions(advance_of(Advance, [])),
    "by hand": instructions(advance_of(ByHand, [])),
    "all": instructions(advance_of(Advance, every)),
}))
"""


def test_a_bond_without_effects_compiles_to_the_code_written_by_hand(tmp_path):
    """Optimised LLVM instructions of one bond: composed without effects = stripped by hand."""
    script = tmp_path / "count.py"
    script.write_text(_COUNT)
    done = subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": ROOT},
    )
    assert done.returncode == 0, done.stderr
    count = json.loads(done.stdout.splitlines()[-1])
    assert count["by hand"] < count["all"]
    assert count["composed"] == count["by hand"], count


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
    frame = simulation.model.bond_frame[0].to_numpy()
    place = simulation.model.centre.copy()
    place[1] += frame.T @ shift
    simulation.state.place(place, [[1.0, 0, 0, 0]] * 2)
    if broken:
        simulation.state.broken_tick[0] = 0
    simulation.advance_to(1)
    simulation.watch.look(simulation.time_s)
    return simulation.report().needs


CASES = {
    "Softening": ([effects.ShearSlip], (PAST, 0.0, 0.0), False),
    "ShearSlip": ([effects.Softening], (0.0, 1e-4, 0.0), False),
    "SphereContact": ([effects.Softening, effects.ShearSlip], (-1e-5, 0.0, 0.0), True),
}


@pytest.mark.parametrize("missing", CASES)
def test_a_run_that_needed_an_absent_effect_says_so(missing):
    classes, shift, broken = CASES[missing]
    listed = [make() for make in classes]
    found = needs_after(listed, shift, broken)
    assert len(found) == 1
    assert found[0].startswith(f"{missing} is left out") and "(bond 0)" in found[0]


def test_a_run_that_stayed_below_the_limits_is_silent():
    assert needs_after([], (1e-6, 1e-6, 0.0)) == ()
