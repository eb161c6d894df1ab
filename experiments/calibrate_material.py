"""Which constants of bonds make a mesh, and specimens of its elements, show what was measured?

Static solves of the mesh fit the moduli of bonds to Young's modulus and Poisson's ratio. Runs of
specimens, with elements of the mesh's median size and ``CohesiveCrack``, fit the tensile strength
of bonds to tension, or else to brazilian, their cohesion to compression, and their friction to the
angle that three pressures around a prism show. If both tension and brazilian are given, tension is
fitted and brazilian compared. Expect each misfit to fall below the tolerance within a few rounds,
or a sentence that says why it does not.

    python experiments/calibrate_material.py
    python experiments/calibrate_material.py --mesh block.msh --young 30e9 --tension 3e6
    python experiments/calibrate_material.py --quick      # static solves alone

Writes calibration.png, targets.csv and summary.json to results/calibrate_material/.
"""

import contextlib
import math
import sys
from functools import partial

import numpy as np
from scipy.optimize import root

from cases.strength_tests import TESTS
from taichi_dem import Material, mesh_stiffness, read_mesh
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import GREY, picture
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.materials.material import POISSON
from taichi_dem.mesh.mesh import element_sizes
from taichi_dem.mesh.shapes import bar

NAME = "calibrate_material"
STRESS, ENERGY = study.number(0, 1e12), study.number(0, 1e9)
ANGLE = study.number(0, 90, open_low=False)
SETTINGS = {
    "mesh": (None, None, str, "mesh file; default: a bar of 192 bodies"),
    "young": (None, None, STRESS, "Young's modulus of the mesh [Pa]"),
    "poisson": (None, None, study.number(*POISSON, open_low=False), "Poisson's ratio of the mesh"),
    "tension": (None, None, STRESS, "strength of a prism in direct tension [Pa]"),
    "brazilian": (None, None, STRESS, "2 P / (pi D t) of a disc between two arcs [Pa]"),
    "compression": (None, None, STRESS, "strength of a prism between held ends [Pa]"),
    "friction": (None, None, ANGLE, "angle by prisms under pressure [degrees]"),
    "tolerance": (0.02, 0.02, study.tolerance, "largest misfit allowed, default 2%"),
    "seed": (0, 0, study.whole(0, 2**31 - 1), "seed of the specimens, default 0"),
    "density": (2450.0, 2450.0, study.number(0, 1e6), "density [kg/m3], default 2450"),
    "fracture_energy": (60.0, 60.0, ENERGY, "fracture energy of a bond [J/m2], default 60"),
    "friction_angle": (30.0, 30.0, ANGLE, "first guess for bonds [degrees], default 30"),
    "damping_ratio": (0.05, 0.05, study.number(0, 10, open_low=False), "of bonds, default 0.05"),
    "tensile_strength": (4e6, 4e6, STRESS, "first guess for bonds [Pa], default 4e6"),
    "cohesion": (12e6, 12e6, STRESS, "first guess for bonds [Pa], default 12e6"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Constant of ``Material.from_elastic`` that meets each target.
SETS = {
    **{"young": "young", "poisson": "poisson"},
    **{"tension": "tensile_strength", "brazilian": "tensile_strength", "compression": "cohesion"},
    "friction": "friction_angle",
}
#: Targets of the full and of the quick job where no option gives one.
ELASTIC = {"young": 32e9, "poisson": 0.2}
FULL = {**ELASTIC, "tension": 4e6, "compression": 6e7, "friction": 35.0}
GIVEN = ("density", "fracture_energy", "friction_angle", "damping_ratio")
GIVEN += ("tensile_strength", "cohesion")
UNITS = {"poisson": "1", "friction_angle": "degrees"}
#: Rounds of static solves and of tests at most; a constant changes by this factor at most.
SOLVES, ROUNDS, FACTOR = 8, 6, 10.0
SHOWN = study.Table(
    target=("target", "target"),
    asked=("asked", "asked", ".5g"),
    found=("found", "found", ".5g"),
    misfit=("misfit", "misfit", "+.2%"),
)


class Unbroken(Exception):
    """A specimen has not failed."""


def met(show, constants, wanted, close, rounds):
    """Constants that meet all targets, and what every round showed; by Broyden's method.

    In logarithms, in which the first step, in proportion, is nearly right. show: what is found for
    constants, by name of a target. wanted: targets. close: misfit that ends it.
    """
    names, found = [*wanted], []
    # Poisson's ratio may be zero or less.
    shift = np.array([float(name == "poisson") for name in names])
    start = np.array([constants[SETS[name]] for name in names]) + shift
    asked = np.array([wanted[name] for name in names]) + shift
    low, high = start / FACTOR, start * FACTOR
    low[shift > 0.0], high[shift > 0.0] = 1.0 + np.array(POISSON)[:, None]

    def misfit(place):
        held = np.clip(np.exp(place), low, high)
        constants.update(zip([SETS[name] for name in names], (held - shift).tolist()))
        found.append(show(constants))
        values = np.array([found[-1][name] for name in names]) + shift
        if not np.all(values > 0.0):
            raise Unbroken
        return np.log(values / asked) + place - np.log(held)

    options = {"fatol": close, "maxiter": rounds, "line_search": None, "jac_options": {"alpha": -1}}
    with contextlib.suppress(Unbroken):
        root(misfit, np.log(start), method="broyden1", options=options)
    return constants, found


def calibrate(mesh, constants, targets, tolerance, test):
    """Constants of ``Material.from_elastic``, what every round showed, and what was found at last.

    test: strength [Pa] of a specimen, by name of the test, constants and target. The last also
    holds targets that no constant was free to meet.
    """

    def elastic(made):
        stiffness = mesh_stiffness(mesh, Material.from_elastic(**made))
        return {name: getattr(stiffness, name) for name in ELASTIC if name in targets}

    def strengths(made):
        return {name: test(name, made, targets[name]) for name in free}

    # Where both are asked for, tension is met and the Brazilian strength compared.
    free = {name: targets[name] for name in TESTS if name in targets}
    free = {name: one for name, one in free.items() if name != "brazilian" or "tension" not in free}
    history, found = [], {}
    for show, names, close, most in (
        (elastic, ELASTIC, 0.1 * tolerance, SOLVES),
        (strengths, free, 0.5 * tolerance, ROUNDS),
    ):
        wanted = {name: targets[name] for name in names if name in targets}
        if wanted:
            constants, rounds = met(show, dict(constants), wanted, close, most)
            history.append(rounds)
            found.update(rounds[-1])
    others = [name for name in targets if name not in found]
    return constants, history, {**found, **{k: test(k, constants, targets[k]) for k in others}}


def misfit_of(name, asked, found):
    """Deviation as a share of the target; of Poisson's ratio, as it is."""
    return found - asked if name == "poisson" else (found - asked) / asked


def complaint(row, history, tolerance):
    """A sentence where a target is not met, else ""."""
    if abs(row["misfit"]) <= tolerance:
        return ""
    missed = f"{row['target']} of {row['asked']:.4g} is not met"
    if math.isnan(row["found"]):
        return f"{missed}: the specimen has not failed at four times this strength's strain"
    free = any(row["target"] in rounds[0] for rounds in history)
    why = "" if free else ", which no constant of the bonds was free to meet"
    return f"{missed}{why}: the mesh shows {row['found']:.4g}"


def draw(path, history, targets, tolerance):
    """Misfit of each target over the rounds that met it."""
    with picture(path, 1, 1, size=(5.2, 3.8)) as (_, axes):
        for rounds in history:
            for name in rounds[0]:
                values = [abs(misfit_of(name, targets[name], row[name])) for row in rounds]
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
    folder, tolerance = study.begin(options), options.tolerance
    mesh = bar(0.08, 0.02, (8, 2, 2)) if options.mesh is None else read_mesh(options.mesh)
    start = {name: targets.get(name, value) for name, value in ELASTIC.items()}
    start.update({name: getattr(options, name) for name in GIVEN})
    element = float(np.median(element_sizes(mesh)))

    def test(name, made, target):
        with ProgressBar(f"{name} at {target:.3g}"):
            return TESTS[name](Material.from_elastic(**made), element, target, options.seed)

    constants, history, found = calibrate(mesh, start, targets, tolerance, test)
    rows = [
        {"target": name, "asked": asked, "found": found[name]}
        | {"misfit": float(misfit_of(name, asked, found[name]))}
        for name, asked in targets.items()
    ]
    SHOWN.show(rows)
    print(*filter(None, (complaint(row, history, tolerance) for row in rows)), sep="\n")
    lines = [f"{name}={value!r}," for name, value in constants.items()]
    print("\n    ".join(["Material.from_elastic(", *lines]) + "\n)\n")
    study.write_rows(folder / "targets.csv", rows)
    draw(folder / "calibration.png", history, targets, tolerance)
    figures = {f"{row['target']}_misfit": (row["misfit"], "1") for row in rows}
    for name in dict.fromkeys(SETS.values()):
        figures[f"bond_{name}"] = constants[name], UNITS.get(name, "Pa")
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
