"""Which constants of bonds make a mesh, and specimens of its elements, show what was measured?

Young's modulus and Poisson's ratio are met by static solves of the mesh, which change the moduli of
bonds. Strengths are met by runs of specimens of elements of the mesh's median size: tension, or
else brazilian, by the tensile strength of bonds, compression by their cohesion. Where tension and
brazilian are both asked for, tension is met and brazilian compared. Expect each misfit to fall
below the tolerance within a few rounds, or a sentence that says why it does not.

    python experiments/calibrate_material.py              # a minute
    python experiments/calibrate_material.py --mesh block.msh --young 30e9 --tension 3e6
    python experiments/calibrate_material.py --quick      # static solves alone

Compression needs slip-energy, and scenes that then list SlipWeakening: bonds that keep their
cohesion harden without a peak. Writes calibration.png, targets.csv and summary.json
to results/calibrate_material/.
"""

import contextlib
import math
import sys
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import root

from _strength_tests import TESTS
from taichi_dem import InputError, Material, mesh_stiffness, read_mesh
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import GREY, picture
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.materials.material import POISSON
from taichi_dem.mesh.shapes import bar
from taichi_dem.stability.step_report import element_sizes

NAME = "calibrate_material"
STRESS, ENERGY = study.number(0, 1e12), study.number(0, 1e9)
SETTINGS = {
    "mesh": (None, None, str, "file of the mesh, a bar of 192 bodies"),
    "young": (None, None, STRESS, "Young's modulus that the mesh is to show [Pa]"),
    "poisson": (None, None, study.number(*POISSON, open_low=False), "its Poisson's ratio"),
    "tension": (None, None, STRESS, "strength of a prism in direct tension [Pa]"),
    "brazilian": (None, None, STRESS, "2 P / (pi D t) of a disc between two arcs [Pa]"),
    "compression": (None, None, STRESS, "strength of a prism between held ends [Pa]"),
    "slip_energy": (None, None, ENERGY, "G_II of SlipWeakening [J/m2]; else bonds slip"),
    "tolerance": (0.02, 0.02, study.tolerance, "misfit that is allowed, 2%"),
    "seed": (0, 0, study.whole(0, 2**31 - 1), "of the specimens, 0"),
    "density": (2450.0, 2450.0, study.number(0, 1e6), "[kg/m3], 2450"),
    "fracture_energy": (60.0, 60.0, ENERGY, "of a bond [J/m2], 60"),
    "friction_angle": (40.0, 40.0, study.number(0, 90, open_low=False), "[degrees], 40"),
    "damping_ratio": (0.05, 0.05, study.number(0, 10, open_low=False), "0.05"),
    "tensile_strength": (4e6, 4e6, STRESS, "of a bond to begin with [Pa], 4e6"),
    "cohesion": (15e6, 15e6, STRESS, "of a bond to begin with [Pa], 15e6"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Constant of ``Material.from_elastic`` that meets each target.
SETS = {
    **{"young": "young", "poisson": "poisson"},
    **{"tension": "tensile_strength", "brazilian": "tensile_strength", "compression": "cohesion"},
}
#: Targets of the full and of the quick job where no option gives one.
ELASTIC = {"young": 32e9, "poisson": 0.2}
FULL = {**ELASTIC, "tension": 4e6, "brazilian": 7.6e6, "compression": 1.2e8}
GIVEN = ("density", "fracture_energy", "friction_angle", "damping_ratio", "tensile_strength")
#: Rounds of static solves and of tests at most; a constant changes by this factor at most.
SOLVES, ROUNDS, FACTOR = 8, 6, 10.0
TABLE = study.Table(
    target=("name", "target"),
    asked=("asked", "asked", ".5g"),
    found=("found", "found", ".5g"),
    misfit=("misfit", "misfit", "+.2%", "1"),
)


class Unbroken(Exception):
    """A specimen has not failed."""


class Match(NamedTuple):
    """A target and what was found; free: whether a constant of bonds was free to meet it."""

    name: str
    asked: float
    found: float
    free: bool = True

    @property
    def misfit(self):
        """Deviation as a share of the target; of Poisson's ratio, as it is."""
        apart = self.found - self.asked
        return apart if self.name == "poisson" else apart / self.asked

    def complaint(self, tolerance):
        """A sentence where the target is not met, else ""."""
        if abs(self.misfit) <= tolerance:
            return ""
        missed = f"{self.name} of {self.asked:.4g} is not met"
        if math.isnan(self.found):
            return f"{missed}: the specimen has not failed at four times this strength's strain"
        why = "" if self.free else ", which no constant of the bonds was free to meet"
        return f"{missed}{why}: the mesh shows {self.found:.4g}"


def met(show, constants, wanted, close, rounds):
    """Constants that meet all targets, and what every round showed; by Broyden's method.

    In logarithms, in which the first step, in proportion, is nearly right. show: what is found for
    constants, by name of a target. wanted: targets. close: misfit that ends it.
    """
    names, found = [*wanted], []
    # Poisson's ratio may be zero or less.
    shift = np.array([float(name == "poisson") for name in names])
    start = np.array([constants[SETS[name]] for name in names]) + shift
    low, high = start / FACTOR, start * FACTOR
    low[shift > 0.0], high[shift > 0.0] = 1.0 + np.array(POISSON)[:, None]

    def misfit(place):
        held = np.clip(np.exp(place), low, high)
        constants.update(zip([SETS[name] for name in names], (held - shift).tolist()))
        found.append(show(constants))
        values = np.array([found[-1][name] for name in names]) + shift
        if not np.all(values > 0.0):
            raise Unbroken
        asked = np.array([wanted[name] for name in names]) + shift
        return np.log(values / asked) + place - np.log(held)

    options = {"fatol": close, "maxiter": rounds, "line_search": None, "jac_options": {"alpha": -1}}
    with contextlib.suppress(Unbroken):
        root(misfit, np.log(start), method="broyden1", options=options)
    return constants, found


def calibrate(mesh, constants, targets, tolerance, test):
    """Constants of ``Material.from_elastic``, what every round showed, and a Match a target.

    test: strength [Pa] of a specimen, by name of the test, constants and target.
    """

    def shown(made):
        stiffness = mesh_stiffness(mesh, Material.from_elastic(**made))
        return {"young": stiffness.young, "poisson": stiffness.poisson}

    def strengths(made):
        return {name: test(name, made, targets[name]) for name in free}

    elastic = {name: targets[name] for name in ("young", "poisson") if name in targets}
    free = {name: targets[name] for name in TESTS if name in targets}
    if "tension" in free:
        free.pop("brazilian", None)
    history, found = [], {}
    for show, wanted, close, most in (
        (shown, elastic, 0.1 * tolerance, SOLVES),
        (strengths, free, 0.5 * tolerance, ROUNDS),
    ):
        if wanted:
            constants, rounds = met(show, dict(constants), wanted, close, most)
            history.append([{name: row[name] for name in wanted} for row in rounds])
            found.update(history[-1][-1])
    others = [name for name in targets if name not in found]
    found.update({name: test(name, constants, targets[name]) for name in others})
    matches = [Match(name, targets[name], found[name], name not in others) for name in targets]
    return constants, history, matches


def draw(path, history, targets, tolerance):
    """Misfit of each target over the rounds that met it."""
    with picture(path, 1, 1, size=(5.2, 3.8)) as (_, axes):
        for rounds in history:
            for name in rounds[0]:
                values = [abs(Match(name, targets[name], row[name]).misfit) for row in rounds]
                axes.semilogy(range(1, len(rounds) + 1), values, "o-", label=name)
        axes.axhline(tolerance, color=GREY, ls="--", lw=1.0, label="tolerance")
        axes.set(xlabel="round of solves or of tests [1]", ylabel="misfit of the target [1]")
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.legend()


def run(options):
    """Calibrate, compare, picture; say which target is not met."""
    targets = {name: value for name in SETS if (value := getattr(options, name)) is not None}
    if not targets:
        targets = ELASTIC if options.quick else FULL
        options.slip_energy = options.slip_energy or 300.0
    if "compression" in targets and options.slip_energy is None:
        raise InputError("slip-energy must be a number where compression is asked for, got None")
    folder = study.begin(options)
    mesh = bar(0.08, 0.02, (8, 2, 2)) if options.mesh is None else read_mesh(options.mesh)
    own = {name: getattr(options, name) for name in (*GIVEN, "cohesion")}
    start = {name: targets.get(name, value) for name, value in ELASTIC.items()} | own
    element, drawn = float(np.median(element_sizes(mesh))), (options.seed, options.slip_energy)

    def test(name, constants, target):
        """Strength [Pa] of a specimen in a test."""
        with ProgressBar(f"{name} at {target:.3g} Pa"):
            material = Material.from_elastic(**constants)
            return TESTS[name].strength(material, element, target, *drawn)

    constants, history, matches = calibrate(mesh, start, targets, options.tolerance, test)
    rows = TABLE.rows(matches)
    TABLE.show(rows)
    print(*filter(None, (match.complaint(options.tolerance) for match in matches)), sep="\n")
    lines = [f"{name}={value!r}," for name, value in constants.items()]
    text = "\n    ".join(["Material.from_elastic(", *lines]) + "\n)\n"
    print(text)
    study.write_rows(folder / "targets.csv", rows)
    draw(folder / "calibration.png", history, targets, options.tolerance)
    figures = {f"{row['target']}_misfit": (row["misfit"], "1") for row in rows}
    for name in dict.fromkeys(SETS.values()):
        figures[f"bond_{name}"] = constants[name], "1" if name == "poisson" else "Pa"
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
