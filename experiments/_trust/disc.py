"""Brazilian disc and direct tension: both strengths of one material, and their ratio."""

from dataclasses import replace
from functools import partial

import numpy as np

from _strength_tests import TESTS
from _strength_tests import disc as disc_mesh
from _trust.number import Number
from taichi_dem.kit.plot_style import BLACK, GREY, RED
from taichi_dem.materials import Material

SOURCE = "Lac du Bonnet granite, Potyondy and Cundall, IJRMMS 41 (2004) 1329"
#: Strength in the Brazilian test over that in direct tension, and what counts as agreement.
RATIO, ALLOWED = 1.28, 0.15
#: Half of the angle of the arcs that load a disc [degrees]: between curved jaws, and twice as wide.
ARCS = 5.0, 10.0
#: Edge of an element [m]; E [Pa], nu, rho [kg/m3], strength [Pa] and fracture energy [J/m2] of a
#: bond, friction [degrees], cohesion [Pa], share of critical damping.
EDGE, STRENGTH = 5e-3, 8e6
ROCK = {
    **{"young": 69e9, "poisson": 0.2, "density": 2630.0, "tensile_strength": STRENGTH},
    **{"fracture_energy": 30.0, "friction_angle": 30.0, "cohesion": 40e6, "damping_ratio": 0.1},
}


def disc(effort):
    """Ratio of both strengths for two widths of the load, and direct tension over a bond's."""
    tension = np.array([strength(TESTS["tension"], seed) for seed in effort.seeds])
    brazilian = np.array(
        [[strength(brazilian_test(arc), seed) for seed in effort.seeds] for arc in ARCS]
    )
    numbers = [
        Number(
            f"disc_ratio_{2 * arc:g}",
            f"Brazilian strength over direct tension, arcs of {2 * arc:g} degrees",
            *("1", SOURCE, RATIO, found / tension),
            note="a wide load holds the disc together beside the split",
            allowed=ALLOWED,
        )
        for arc, found in zip(ARCS, brazilian)
    ]
    words = "direct tension over the strength of a bond"
    bonds = Number("disc_tension", words, "1", "one bond", 1.0, tension / STRENGTH)
    return [*numbers, bonds], partial(draw, tension=tension / 1e6, brazilian=brazilian[0] / 1e6)


def brazilian_test(arc):
    """The test on a disc that is loaded on arcs of some half angle [degrees]."""
    return replace(TESTS["brazilian"], specimen=partial(disc_mesh, arc=arc))


def strength(test, seed):
    """Strength of a random specimen [Pa]."""
    return test.strength(Material.from_elastic(**ROCK), EDGE, STRENGTH, seed, None)


def draw(axes, tension, brazilian):
    """Both strengths of every mesh, and the ratio of granite."""
    ends = np.array([0.0, 1.15 * tension.max()])
    near = (RATIO * (1.0 + way) * ends for way in (-ALLOWED, ALLOWED))
    axes.fill_between(ends, *near, color=GREY, alpha=0.25, label=f"within {100 * ALLOWED:.0f} %")
    axes.plot(ends, RATIO * ends, color=BLACK, lw=0.8, label="ratio of granite")
    axes.plot(tension, brazilian, "o", color=RED, ms=4, label="a random mesh")
    axes.set(
        xlabel="direct tension [MPa]", ylabel="Brazilian test, arcs of 10 degrees [MPa]", xlim=ends
    )
    axes.legend(loc="lower right")
