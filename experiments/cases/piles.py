"""Blocks that stand on a plate by weight and friction."""

from dataclasses import replace

from taichi_dem import CONCRETE, effects

#: Blocks that stand on a plate by weight and friction: acceleration [m/s2], down along x; springs
#: softer than those of concrete, for long steps: a block sinks in by a micrometre; step [s].
GRAVITY, SOFT, STEP = 9.81, 0.01, 1e-5


def softened(friction):
    """Concrete with all springs softer."""
    names = ("normal_stiffness", "shear_stiffness", "contact_stiffness")
    dashpots = ("normal_damping", "shear_damping", "contact_damping")
    values = {name: SOFT * getattr(CONCRETE, name) for name in names}
    values.update({name: SOFT**0.5 * getattr(CONCRETE, name) for name in dashpots})
    return replace(CONCRETE, friction=friction, fracture_energy=1e5, **values)


def loose(weight=(-GRAVITY, 0.0, 0.0), fixed=("plate_left",), **contact):
    """Effects of blocks that touch and stick, on plates that are held at groups ``fixed``."""
    touch = effects.BondDamping(), effects.BodyContact(**contact), effects.StickingFriction()
    return [*touch, effects.Gravity(tuple(weight)), *map(effects.Fixed, fixed)]
