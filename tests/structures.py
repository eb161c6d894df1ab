"""Structures that tests compile: sets of effects by name, each with the question it answers.

Every set of effects and kind of method has kernels of its own, which take seconds to compile. A
test takes one of these sets, with its own effects in it; the others of the set do nothing, to the
bit. A test that needs another set adds a row and says what it is for.
"""

from taichi_dem import effects
from taichi_dem.engine import Structure
from taichi_dem.mesh.shapes import single

#: Effects by name of the set, in their order.
STRUCTURES = {
    # What follows from motion and from elastic or damped, breaking or slipping bonds.
    "bonds": (effects.BondDamping, effects.Softening, effects.ShearSlip, effects.GasPressure),
    # The same with contact of spheres: the paper's block, and all that has its bits.
    "paper": (
        *(effects.BondDamping, effects.Softening, effects.ShearSlip),
        *(effects.SphereContact, effects.Friction, effects.GasPressure),
    ),
    # That of the paper in solids that are held.
    "held": (
        *(effects.BondDamping, effects.Softening, effects.ShearSlip),
        *(effects.SphereContact, effects.Friction, effects.GasPressure, effects.Fixed),
    ),
    # What loads and supports give a solid, and each other.
    "supports": (
        *(effects.BondDamping, effects.Fixed, effects.Roller, effects.PrescribedMotion),
        *(effects.Softening, effects.Gravity, effects.Pressure, effects.GasPressure),
        effects.QuietBoundary,
    ),
    # How whole bodies meet, rest and slide on each other.
    "bodies": (
        *(effects.BondDamping, effects.Softening, effects.BodyContact, effects.StickingFriction),
        *(effects.Gravity, effects.Fixed, effects.GasPressure),
    ),
}

#: A body far from all others, for supports and loads that never act: its group is "post_base".
POST = {"post": (single(), (10.0, 0.0, 0.0))}


def filled(name, *own, group="left"):
    """Effects of a set: own ones, and for the others some that never act.

    group: of faces of bodies that nothing moves, or that gas which never comes would push on.
    """
    given = {type(one): one for one in own}
    made = [given.pop(kind, None) or _idle(kind, group) for kind in STRUCTURES[name]]
    assert not given, f"not in the set {name}: {[*given]}"
    return made


def _idle(kind, group):
    """An effect that never acts."""
    made = {
        effects.Gravity: lambda: effects.Gravity((0.0, 0.0, 0.0)),
        effects.GasPressure: lambda: effects.GasPressure(group, start=1.0),
        effects.Pressure: lambda: effects.Pressure(group, 0.0),
        effects.Fixed: lambda: effects.Fixed(group),
        effects.Roller: lambda: effects.Roller(group, (1.0, 0.0, 0.0)),
        effects.PrescribedMotion: lambda: effects.PrescribedMotion(group, (0.0, 0.0, 0.0)),
        effects.QuietBoundary: lambda: effects.QuietBoundary(group, 1.0, 1.0),
        # The material has no friction where it is not to act.
        effects.StickingFriction: effects.StickingFriction,
    }
    return made[kind]() if kind in made else kind().silent()


def name_of(structure):
    """Name of a structure: of its set of effects, or of its parts where it is in none; method."""
    if not isinstance(structure, Structure):
        return _words(getattr(structure, "key", structure))
    kinds, method = tuple(map(type, structure.effects)), structure.key[1]
    name = next((name for name, row in STRUCTURES.items() if row == kinds), None)
    return f"{name or _words(kinds)}: {_words(method)}"


def _words(parts):
    """A structure's key in words."""
    if isinstance(parts, tuple):
        return " ".join(filter(None, map(_words, parts)))
    return "" if parts is None or parts is False else getattr(parts, "__name__", str(parts))
