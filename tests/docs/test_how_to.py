"""Python blocks of all pages but the first: run as they stand, judged by their formulas."""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from tests.docs.pages import PAGES, blocks, run_pasted
from tests.processes import users_environment
from tests.scenes import ROOT
from tests.slow import slow_but

#: What the tests below look at, in the program of the one block of a page.
WANTED = {
    "docs/add_an_effect.md": "dict(moved=moved, mass=result.model.body_mass[0],"
    " energy_balance=result.report.energy_balance)",
    "docs/add_a_contact_law.md": "dict(mass=simulation.model.body_mass[0], speed=speed,"
    " stiffness=stiffness, deepest=deepest, rebound=rebound, account=account,"
    " unexplained=unexplained)",
    "docs/add_a_damper_accounting.md": "dict(force=force)",
    "docs/results.md": "dict(units=result.history.units, out=out)",
    "docs/add_a_time_integrator.md": "dict(area=model.bonds['area'][0], mass=model.body_mass[0],"
    " step=step, count=count, euler=euler, leapfrog=leapfrog)",
}
#: Pages whose blocks have tests of their own.
APART = ("README.md", "docs/long_runs.md", "docs/hard_cases.md")
BLOCKS = [
    (page, number) for page in PAGES if page not in APART for number in range(len(blocks(page)))
]
#: Pages whose blocks take longer: runs to an accuracy, several kinds of structures, pages of HTML.
LONG = [
    f"docs/{name}.md"
    for name in (
        *("accuracy", "boundaries", "damper_engineering", "effects_auto", "look", "material"),
        "tutorial",
    )
]
COLLISION = "docs/tutorial.md", 1
QUICK = [block for block in BLOCKS if block[0] not in LONG or block == COLLISION]


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """``program(page, number)``: a block that has run, once for all tests."""
    made = {}

    def run(page, number=0):
        if (page, number) not in made:
            wanted = WANTED.get(page, "None") if number == 0 else "None"
            folder = tmp_path_factory.mktemp("page")
            made[page, number] = run_pasted(blocks(page)[number], folder, wanted)
        return made[page, number]

    return run


@pytest.fixture
def left_by(program):
    """``left_by(name)``: what ``WANTED`` asks of the page docs/name.md."""
    return lambda name: program(f"docs/{name}.md").left


def test_programs_of_the_tutorial_are_short():
    assert [len(block.splitlines()) <= 25 for block in blocks("docs/tutorial.md")] == [True] * 3


def test_the_blocks_of_the_tutorial_keep_their_momentum(program):
    """v1 + v2 = 2 m/s, of which three digits are printed each; the text has the same digits."""
    made = program(*COLLISION)
    before, after = np.array(
        [[float(word) for word in line.split() if "." in word] for line in made.said.splitlines()]
    ).T
    assert before.tolist() == [2.0, 0.0] and after.sum() == pytest.approx(2.0, abs=1.1e-3)
    assert after == pytest.approx([0.208, 1.792], abs=2e-3)
    assert (made.folder / "blocks.png").stat().st_size > 5000


def test_each_how_to_has_a_block():
    assert {page for page, _ in BLOCKS} >= {page for page in PAGES if page.startswith("docs/add_")}


@pytest.mark.parametrize(
    "block", slow_but(BLOCKS, *QUICK), ids=lambda block: "{}-{}".format(*block)
)
def test_a_block_runs_as_it_stands_and_says_something(program, block):
    assert program(*block).said.strip()


@pytest.mark.slow
def test_the_hard_case_is_found_in_its_file_and_passes(tmp_path):
    """The block as a file beside the others, asked for by its name."""
    experiments = tmp_path / "experiments"
    shutil.copytree(os.path.join(ROOT, "experiments"), experiments)
    (block,) = blocks("docs/hard_cases.md")
    (experiments / "_hard_cases" / "mine.py").write_text(block)
    line = [sys.executable, str(experiments / "hard_cases.py"), "--quick", "--only"]
    line += ["straight_flight", "--out", str(tmp_path / "out")]
    done = subprocess.run(line, env=users_environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    figures = json.loads((tmp_path / "out" / "summary.json").read_text())["figures"]
    assert figures["failed"]["value"] == 0 and figures["passed"]["value"] > 0


def test_the_effect_moves_a_body_as_the_leapfrog_must(left_by):
    """v_n = a dt sum of sin(w k dt), k < n, and x = dt sum of v_n: (a T dt / 2) cot(pi dt / T).

    200 steps of round-off on 1e-4 m beside a centre 0.01 m from the origin: 200 x 2^-53 x 0.01 m.
    """
    left = left_by("add_an_effect")
    amplitude, period, step = 2.0, 0.02, 1e-4
    expected = 0.5 * amplitude * period * step / np.tan(np.pi * step / period)
    assert left["moved"] == pytest.approx(expected, abs=200 * 2.0**-53 * 0.02)
    # Of the largest kinetic energy on the way, m (2 a / w)^2 / 2, as at the end there is none.
    mass = left["mass"]
    most = 0.5 * mass * (amplitude * period / np.pi) ** 2
    assert abs(left["energy_balance"]["residual"]) < 200 * 2.0**-52 * most


def test_the_contact_law_stores_what_it_takes(left_by):
    """m v^2 = 39 (2/5) k D^(5/2), and the speed comes back.

    The leapfrog is of second order: relative errors of (w dt)^2 with the stiffness at the deepest
    place, w^2 = 39 (3/2) k sqrt(D) / (m / 2). That place is looked for every five steps: at most
    2.5 away from it, where the way is short by (w 2.5 dt)^2 / 2 of D. On the way velocities are
    half a step old, and the account is off by F v dt / 2, at most w dt / 2 of the energy.
    """
    left = left_by("add_a_contact_law")
    mass, speed, stiffness = left["mass"], left["speed"], left["stiffness"]
    depth = (mass * speed**2 / (39 * 0.4 * stiffness)) ** 0.4
    second_order = 117.0 * stiffness * np.sqrt(depth) / mass * 1e-7**2
    assert left["deepest"] == pytest.approx(depth, rel=(1 + 2.5**2 / 2) * second_order)
    assert left["rebound"] == pytest.approx(speed, rel=second_order)
    energy, unexplained = left["account"]["kinetic"], left["unexplained"]
    assert max(unexplained) < 0.5 * np.sqrt(second_order) * energy
    assert unexplained[-1] < second_order * energy
    assert left["account"]["sphere_strain"] == 0.0


def test_the_integrator_gains_energy_by_its_factor(left_by):
    """E_n = E_0 (1 + (w dt)^2)^n; openings of 1e-8 m beside coordinates of 0.01 m keep 1e-10."""
    left = left_by("add_a_time_integrator")
    step = left["step"]
    rate2 = 2.0 * 450e9 * 3.0 * left["area"] / left["mass"]
    expected = (1.0 + rate2 * step**2) ** np.arange(left["count"] + 1)
    assert left["euler"] / left["euler"][0] == pytest.approx(expected, rel=1e-7)
    # Of energies of one time the leapfrog's differ by (w dt)^2 / 4, cos^2(p / 2) at phase p.
    swing = 0.25 * rate2 * step**2 * 1.01
    assert left["leapfrog"] / left["leapfrog"][0] == pytest.approx(1.0, rel=swing)


def test_results_have_units_and_files(program):
    """Of a block with a hole, which has all columns; every figure and file that the page names."""
    made = program("docs/results.md")
    units = made.left["units"]
    assert all(units.values()) and units["hole_radial_displacement_mm"] == "mm"
    there = {path.name for path in (made.folder / made.left["out"]).iterdir()}
    figures = "history energy energy_shares cracks fragments rose attenuation damage"
    wanted = {f"{name}.png" for name in figures.split()}
    assert wanted | {"run.vtkhdf", "bodies.xyz", "fragments.xyz", "run.glb"} <= there


def test_the_accounting_gives_the_container_the_weight_and_landings_do_not(left_by):
    """m g of a particle at rest, to the momentum of 4 g dt at both ends of two seconds."""
    force, weight, step, seconds = left_by("add_a_damper_accounting")["force"], 2e-3, 1e-4, 2.0
    assert force["walls"] == pytest.approx(-weight, rel=8 * step / seconds)
    assert force["landing"] == 0.0
