"""Ranges in which the rules of the automaton were checked, and scenes outside them."""

from typing import Any

import numpy as np

from ca_damper.report.certificate import CheckedRange, Driven
from ca_damper.scenes.gravity import gravity_across

_G = 9.81
_PAPER = (
    "11 to 50 grains of at most 0.1 of the container's mass, gravity, restitution from 0.5 on, "
    "motions above 1 g and half a cell: peaks at resonance within 3 % of spheres"
)
_PLACE = (
    "1 to 50 grains, 0.8 to 8 g, restitution up to 0.9: impedance within 20 % of that of spheres "
    "at four of five points, worst at five and ten grains; loss within 4 % in the median, 40 % at "
    "worst"
)


def range_of(automaton: Any, driven: Driven) -> CheckedRange:
    """The range of the rules of an automaton, and what of the scenes lies outside."""
    if automaton.rules == "place":
        return CheckedRange(_PLACE, tuple(_beyond_place(automaton, driven)))
    outside = tuple(_beyond_paper(automaton, driven))
    warning = (
        f"rules 'paper' of the automaton are known to fail with {'; with '.join(outside)}: use "
        "rules='place', the default"
    )
    return CheckedRange(_PAPER, outside, warning if outside else "")


def _beyond_paper(automaton, driven):
    """Where the rules of the paper are known to fail, with a figure each."""
    some = driven.particles > 0
    heaviest = automaton.particle_mass / driven.mass[some].min(initial=np.inf)
    fewest = driven.particles[some].min(initial=11)
    if heaviest > 0.1:
        yield (
            f"a grain of {heaviest:.3g} of the container's mass, above 0.1 (one of 0.2 makes the "
            "energy grow 36-fold)"
        )
    if fewest <= 10:
        yield (
            f"{fewest} grain{'' if fewest == 1 else 's'}, ten or fewer (one is off by up to 824 % "
            "in 76 published cases)"
        )
    if some.any() and automaton.gravity == 0.0:
        yield "no gravity (40 grains at 6 Hz and 20 mm lose eight times too much)"
    yield from _beyond_motions(automaton, driven, some & (driven.amplitude > 0.0))
    least = min(automaton.restitution, automaton.wall_restitution)
    if some.any() and least < 0.5:
        yield f"restitution {least:g}, below 0.5"


def _beyond_motions(automaton, driven, moved):
    """Motions of a driven container too small for the lattice; moved: scenes, (scenes,)."""
    slow = driven.acceleration[moved].min(initial=np.inf) / _G
    small, cell = driven.amplitude[moved].min(initial=np.inf), automaton.width
    if slow < 1.0:
        yield (
            f"a motion of {slow:.2g} g, below 1 g (at 0.6 g and 12 Hz the loss is 0.07 of N m w, "
            "not 0)"
        )
    if small < 0.5 * cell:
        yield (
            f"a motion of {1e3 * small:.2g} mm, below half a cell of {1e3 * cell:g} mm (at 2 g and "
            "25 Hz the loss is 0.20 of N m w, not 0.57)"
        )


def _beyond_place(automaton, driven):
    """What was not checked of the rules of place, or is known to be off."""
    some = driven.particles > 0
    most, moved = driven.particles.max(initial=0), some & (driven.amplitude > 0.0)
    if most > 50:
        yield f"{most} grains, more than 50"
    levels = driven.acceleration[moved] / _G
    for level in {levels.min(initial=0.8), levels.max(initial=8.0)}.difference({0.8, 8.0}):
        yield f"a motion of {level:.2g} g"
    if some.any() and gravity_across(automaton):
        yield (
            "gravity across the columns (a box on its side: loss within 5 % of that of spheres in "
            "the median of 135 points, 32 % at nine of ten, 76 % at worst, with beds of several "
            "layers, which interlock)"
        )
    highest = max(automaton.restitution, automaton.wall_restitution)
    if some.any() and highest > 0.9:
        yield (
            f"restitution {highest:g}, above 0.9 (of 1 without friction, two grains keep their "
            "energy in 3 s, five 0.5 to 0.9 of it, twenty 0.16 to 0.22, spheres 0.999)"
        )
