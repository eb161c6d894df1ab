"""Every Python block of the pages runs as it stands, and what it computes follows its formula."""

import runpy
import subprocess
import sys

import numpy as np
import pytest

from ca_damper.report.certificate import certificate_of
from taichi_dem import CONCRETE, runtime
from tests.docs.pages import FOLDER, PAGES, blocks, lines
from tests.processes import phases_of, users_environment

pytestmark = pytest.mark.experiment

#: Blocks that a process of their own runs: the first one that a user sees, and those that start
#: processes themselves. All others share the session, and so the engines, of the tests.
APART = ("README.md", 0), ("docs/sweeps.md", 0)
BLOCKS = [(page, number) for page in PAGES for number in range(len(blocks(page)))]
# Those of the damper last: the first engine of the session is then that of the first block, whose
# process has left its kernels on the disk. They are found only where they are the first there too.
BLOCKS.sort(key=lambda block: "from ca_damper" in blocks(block[0])[block[1]])


@pytest.fixture(scope="module")
def left_by(tmp_path_factory):
    """``left_by(page, number)``: names that a block has left, run once for all tests."""
    made = {}

    def run(page, number=0):
        if (page, number) not in made:
            folder = tmp_path_factory.mktemp("page")
            (folder / "pasted.py").write_text(blocks(page)[number], encoding="utf-8")
            with pytest.MonkeyPatch.context() as patched:
                patched.chdir(folder)
                patched.setattr(runtime, "start", lambda *_, **__: None)
                made[page, number] = runpy.run_path("pasted.py", run_name="__main__")
        return made[page, number]

    return run


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: "{}-{}".format(*block))
def test_a_block_runs_as_it_stands(left_by, block, tmp_path):
    if block not in APART:
        left_by(*block)
        return
    (tmp_path / "pasted.py").write_text(blocks(block[0])[block[1]], encoding="utf-8")
    options = {"capture_output": True, "text": True, "timeout": 600}
    line = [sys.executable, "pasted.py"]
    done = subprocess.run(line, cwd=tmp_path, env=users_environment(), **options)
    assert done.returncode == 0 and phases_of(done.stderr)[1] == [] and done.stdout, done.stderr


#: What a new user types first; the tests themselves are part of it.
FIRST = ("make demo", "make test")
PASTED = [line for line in lines("README.md") if not line.startswith(FIRST)]


@pytest.mark.parametrize("line", PASTED)
def test_a_command_of_the_first_page_works_when_it_is_pasted(line, tmp_path):
    """In a clean shell after ``make demo``, in a folder of links with results of its own."""
    for one in FOLDER.iterdir():
        if one.name != "results":
            (tmp_path / one.name).symlink_to(one)
    shell = {"shell": True, "executable": "/bin/sh", "cwd": tmp_path, "timeout": 600}
    done = subprocess.run(
        line, **shell, env=users_environment(), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and done.stdout and (tmp_path / "results").is_dir(), done.stderr


def test_the_effect_moves_a_body_as_the_leapfrog_must(left_by):
    """v_n = a dt sum of sin(w k dt), k < n, and x = dt sum of v_n: (a T dt / 2) cot(pi dt / T).

    200 steps of round-off on 1e-4 m beside a centre 0.01 m from the origin: 200 x 2^-53 x 0.01 m.
    """
    left = left_by("docs/add_an_effect.md")
    amplitude, period, step = 2.0, 0.02, 1e-4
    expected = 0.5 * amplitude * period * step / np.tan(np.pi * step / period)
    assert left["moved"] == pytest.approx(expected, abs=200 * 2.0**-53 * 0.02)
    # Of the largest kinetic energy on the way, m (2 a / w)^2 / 2, as at the end there is none.
    mass = left["result"].model.body_mass[0]
    most = 0.5 * mass * (amplitude * period / np.pi) ** 2
    assert abs(left["result"].report.energy_balance["residual"]) < 200 * 2.0**-52 * most


def test_the_plastic_bond_takes_its_strength_times_its_flow(left_by):
    """f_t A (d - f_t / k_n); a step overshoots by k_n v dt, of which flow takes half."""
    left = left_by("docs/add_a_bond_law.md")
    strength, stiffness = CONCRETE.tensile_strength, CONCRETE.normal_stiffness
    area = 3.0 * left["simulation"].model.bonds["area"][0]
    flow = left["count"] * left["step"] * left["speed"] - strength / stiffness
    overshoot = stiffness * left["speed"] * left["step"] / strength
    assert left["balance"]["slip"] == pytest.approx(strength * area * flow, rel=overshoot)
    assert abs(left["balance"]["residual"]) < overshoot * left["balance"]["support_work"]


def test_the_contact_law_stores_what_it_takes(left_by):
    """m v^2 = 39 (2/5) k D^(5/2), for 2.943 D / (2 v), and the speed comes back.

    The leapfrog is of second order: relative errors of (w dt)^2 with the stiffness at the deepest
    place, w^2 = 39 (3/2) k sqrt(D) / (m / 2). That place is looked for every five steps: at most
    2.5 away from it, where the way is short by (w 2.5 dt)^2 / 2 of D. On the way velocities are
    half a step old, and the account is off by F v dt / 2, at most w dt / 2 of the energy.
    """
    left = left_by("docs/add_a_contact_law.md")
    mass, speed, stiffness = left["simulation"].model.body_mass[0], left["speed"], left["stiffness"]
    depth = (mass * speed**2 / (39 * 0.4 * stiffness)) ** 0.4
    second_order = 117.0 * stiffness * np.sqrt(depth) / mass * left["dt"] ** 2
    assert left["deepest"] == pytest.approx(depth, rel=(1 + 2.5**2 / 2) * second_order)
    assert left["rebound"] == pytest.approx(speed, rel=second_order)
    # Counted every five steps.
    assert left["lasted"] == pytest.approx(2.943 * depth / (2.0 * speed), abs=5 * left["dt"])
    energy, unexplained = left["account"]["kinetic"], left["unexplained"]
    assert max(unexplained) < 0.5 * np.sqrt(second_order) * energy
    assert unexplained[-1] < second_order * energy


def test_the_integrator_gains_energy_by_its_factor(left_by):
    """E_n = E_0 (1 + (w dt)^2)^n; openings of 1e-8 m beside coordinates of 0.01 m keep 1e-10."""
    left = left_by("docs/add_a_time_integrator.md")
    model, step = left["model"], left["step"]
    rate2 = 2.0 * 450e9 * 3.0 * model.bonds["area"][0] / model.body_mass[0]
    expected = (1.0 + rate2 * step**2) ** np.arange(left["count"] + 1)
    assert left["euler"] / left["euler"][0] == pytest.approx(expected, rel=1e-7)
    # Of energies of one time the leapfrog's differ by (w dt)^2 / 4, cos^2(p / 2) at phase p.
    swing = 0.25 * rate2 * step**2 * 1.01
    assert left["leapfrog"] / left["leapfrog"][0] == pytest.approx(1.0, rel=swing)


def test_grains_that_stick_go_on_with_half_of_the_velocity(left_by):
    """The floor gives the first 1 + e times its speed; a half is exact."""
    left = left_by("docs/add_an_automaton_rule.md")
    met = left["before"][0.3][0, 1]
    floor = 3e-3 * 2.0 * np.pi * 6.0
    assert met == pytest.approx(1.75 * floor, rel=1e-9)
    assert np.array_equal(left["after"][0.3], [[0.0, 0.5 * met]] * 2)
    # Faster ones bounce.
    assert np.diff(left["after"][0.1][:, 1]) > 0.0
    # Nobody has compared such rules; momentum closes, and a certificate tells where it does not.
    (unknown,) = left["batch"].certificate.but_for
    assert "rules Sticky" in unknown
    assert "momentum closes only to 0.1 %" in certificate_of(left["batch"], 1e-3).but_for
