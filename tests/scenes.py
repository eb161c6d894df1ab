"""Scenes that several tests share."""

import os

from taichi_dem import CONCRETE, PAPER_BLOCK, Scene, effects, read_mesh

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def paper_effects(peak=575e6, rise=1.33e-4, **contact):
    """All effects of the paper; contact: options of SphereContact, of broken faces by default."""
    return [
        effects.BondDamping(),
        effects.Softening(),
        effects.ShearSlip(),
        effects.SphereContact(**{"outer_faces": False, **contact}),
        effects.Friction(),
        effects.GasPressure(peak=peak, rise=rise),
    ]


def paper_scene(**options):
    """The paper's block with all of its effects."""
    return Scene(read_mesh(PAPER_BLOCK), CONCRETE, paper_effects(**options))


def brisk_scene(**contact):
    """The paper's block under a harder, faster pulse: 90 bonds break within 3e-5 s."""
    return paper_scene(peak=3 * 575e6, rise=4e-5, **contact)
