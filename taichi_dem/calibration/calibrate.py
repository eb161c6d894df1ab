"""Find the constants of bonds with which a mesh shows wanted moduli and strengths."""

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Optional

import numpy as np

from taichi_dem.calibration.strength_tests import TESTS
from taichi_dem.elasticity.mesh_stiffness import mesh_stiffness
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.likely_units import MODULUS, STRENGTH, in_unit
from taichi_dem.kit.validation import between, instance, positive, told_apart, whole
from taichi_dem.materials import Material
from taichi_dem.materials.bond_rules import (
    ContactShareOfCritical,
    FaceStiffness,
    ModulusOverDistance,
    ShareOfCritical,
)
from taichi_dem.materials.moduli import POISSON, bond_moduli, checked_poisson, elastic_constants
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.stability.elastic_report import element_sizes

#: Static solves, and rounds of tests, at most.
_SOLVES, _ROUNDS = 8, 6
#: Constants of a material that the tests of strength set.
_SETS = {
    "tension": "tensile_strength",
    "brazilian": "tensile_strength",
    "compression": "cohesion",
}


@dataclass(frozen=True)
class Targets:
    """Elastic constants and strengths that a mesh and its specimens are to show.

    Parameters
    ----------
    young : float, optional
        Young's modulus of the mesh [Pa], the mean over all directions; None where it is not asked
        for, likewise for all that follow.
    poisson : float, optional
        Poisson's ratio of the mesh.
    tension : float, optional
        Strength of a prism in direct tension [Pa].
    brazilian : float, optional
        Splitting strength 2 P / (pi D t) of a disc between two arcs of 20 degrees [Pa].
    compression : float, optional
        Strength of a prism between ends that hold it, twice as long as wide [Pa].

    Raises
    ------
    InputError
        A value is out of its range, or none is given.

    Examples
    --------
    >>> Targets(young=30e9, tension=3e6).young
    30000000000.0
    """

    young: Optional[float] = None
    poisson: Optional[float] = None
    tension: Optional[float] = None
    brazilian: Optional[float] = None
    compression: Optional[float] = None

    def __post_init__(self):
        for name in ("young", "tension", "brazilian", "compression"):
            if getattr(self, name) is not None:
                value = positive(name, getattr(self, name))
                in_unit(name, value, MODULUS if name == "young" else STRENGTH)
        if self.poisson is not None:
            checked_poisson(self.poisson)
        if all(getattr(self, field.name) is None for field in fields(self)):
            raise InputError("targets must hold one value at least, got none")


@dataclass(frozen=True)
class Match:
    """A target of a calibration and what was found.

    Parameters
    ----------
    name : str
        Name of the target.
    target : float
        Wanted value [Pa], of Poisson's ratio [-].
    found : float
        Value that was found, in the same unit [Pa or -].
    set : bool
        Whether a constant of the bonds was free to meet it.
    """

    name: str
    target: float
    found: float
    set: bool

    @property
    def misfit(self) -> float:
        """Deviation as a share of the target; of Poisson's ratio, as it is."""
        apart = self.found - self.target
        return apart if self.name == "poisson" else apart / self.target

    def is_met(self, tolerance: float) -> bool:
        """Whether the misfit is within a tolerance; False where nothing was found.

        Parameters
        ----------
        tolerance : float
            Largest misfit, a share of the target.

        Returns
        -------
        bool
            True where the target is met.
        """
        return abs(self.misfit) <= positive("tolerance", tolerance, zero_allowed=True)


@dataclass(frozen=True, eq=False)
class Calibration:
    """A material, and how well it meets each target.

    Parameters
    ----------
    material : Material
        The calibrated material.
    matches : tuple of Match
        Match of each target.
    tolerance : float
        Misfit up to which a target counts as met, as a share.
    runs : int
        Number of runs of specimens.
    reach : tuple of str, default ()
        Sentences on targets that no constants meet.
    """

    material: Material
    matches: tuple[Match, ...]
    tolerance: float
    runs: int
    reach: tuple[str, ...] = ()

    @property
    def met(self) -> bool:
        """Whether all targets are met."""
        return all(match.is_met(self.tolerance) for match in self.matches)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for every target that is not met, and for each out of reach."""
        missed = [match for match in self.matches if not match.is_met(self.tolerance)]
        return (*self.reach, *(self._sentence(match) for match in missed))

    def _sentence(self, match):
        if math.isnan(match.found):
            return (
                f"{match.name} of {match.target:.4g} is not met: the specimen has not failed at "
                "four times the strain of this strength"
            )
        why = "" if match.set else ", which no constant of the bonds was free to meet"
        return (
            f"{match.name} of {match.target:.4g} is not met{why}: the mesh shows {match.found:.4g}"
        )

    def __repr__(self):
        words = [f"{match.name} {match.misfit:+.2g}" for match in self.matches]
        return in_brief(self, *words, *self.warnings, "print it for the table")

    def __str__(self):
        """A line a target, then what was not met, and the cost."""
        lines = [f"{'target':12s}{'asked':>12s}{'found':>12s}{'misfit':>10s}"]
        for match in self.matches:
            misfit = f"{match.misfit:+.4f}"
            if match.name != "poisson":
                misfit = f"{100.0 * match.misfit:+.2f} %"
            lines.append(f"{match.name:12s}{match.target:12.5g}{match.found:12.5g}{misfit:>10s}")
        lines += [f"warning: {warning}" for warning in self.warnings]
        return "\n".join([*lines, f"{self.runs} runs of specimens"])


def calibrate(
    mesh: Mesh,
    material: Material,
    targets: Targets,
    tolerance: float = 0.02,
    slip_energy: Optional[float] = None,
    seed: int = 0,
) -> Calibration:
    """Change a material such that a mesh, and specimens of its elements, show given properties.

    Parameters
    ----------
    mesh : Mesh
        Mesh of the scene.
    material : Material
        Material to begin with, from ``Material.from_elastic``; what no target asks for stays.
    targets : Targets
        Elastic constants and strengths.
    tolerance : float, default 0.02
        Misfit that is allowed, as a share of the target (of Poisson's ratio, as it is).
    slip_energy : float, optional
        Fracture energy G_II of ``effects.SlipWeakening`` in all tests [J/m^2]; the scene then must
        list that effect. None: tests use ``ShearSlip``, by which bonds keep their cohesion.
    seed : int, default 0
        Seed of the specimens.

    Returns
    -------
    Calibration
        The material, the misfit of each target, and a sentence where a target is not met.

    Raises
    ------
    InputError
        An argument is invalid, the material has constants per area, or compression is asked for
        without slip_energy: specimens then harden without a peak.

    Notes
    -----
    Young's modulus and Poisson's ratio are met by static solves of the mesh, which change the
    moduli of bonds. Strengths are met by runs of specimens of elements of the mesh's median size:
    tension, or else brazilian, by the tensile strength of bonds, compression by their cohesion.
    Where tension and brazilian are both asked for, tension is met and brazilian compared.

    Examples
    --------
    >>> calibrate(mesh, material, Targets(young=30e9)).material  # doctest: +SKIP
    """
    instance("mesh", mesh, Mesh)
    instance("targets", targets, Targets)
    instance("material", material, Material)
    _nominal(material)
    tolerance = between("tolerance", tolerance, 1e-4, 0.5)
    seed = whole("seed", seed, 0, 2**31 - 1)
    if slip_energy is not None:
        slip_energy = positive("slip_energy", slip_energy)
    elif targets.compression is not None:
        raise InputError(
            "slip_energy must be a number where compression is asked for, as specimens whose bonds "
            "keep their cohesion harden without a peak, got None"
        )
    material, matches, reach = _moduli(mesh, material, targets, tolerance)
    element = float(np.median(element_sizes(mesh)))

    def run(name, present, target):
        """Strength [Pa] of a specimen in a test."""
        return TESTS[name].strength(present, element, target, seed, slip_energy)

    material, strengths, runs = _strengths(material, run, targets, tolerance)
    return Calibration(material, (*matches, *strengths), tolerance, runs, reach)


def _moduli(mesh, material, targets, tolerance):
    """Material whose mesh shows the wanted E and nu; matches; sentences on what is out of reach.

    Fixed points: E is in proportion to both moduli, nu depends on their ratio alone.
    """
    if targets.young is None and targets.poisson is None:
        return material, (), ()
    young, poisson = _nominal(material)
    found, close = mesh_stiffness(mesh, material), 0.1 * tolerance
    for _ in range(_SOLVES):
        scale = 1.0 if targets.young is None else targets.young / found.young
        apart = 0.0 if targets.poisson is None else targets.poisson - found.poisson
        ratio = float(np.clip(poisson + apart, *POISSON))
        if abs(scale - 1.0) < close and abs(ratio - poisson) < close:
            break
        young, poisson = scale * young, ratio
        material = with_moduli(material, *bond_moduli(young, poisson))
        found = mesh_stiffness(mesh, material)
    pairs = ("young", targets.young, found.young), ("poisson", targets.poisson, found.poisson)
    matches = [Match(name, value, shown, True) for name, value, shown in pairs if value is not None]
    return material, tuple(matches), _out_of_reach(targets, found, tolerance, poisson)


def _out_of_reach(targets, found, tolerance, poisson):
    """A sentence where Poisson's ratio ended at a limit of the bonds."""
    missed = targets.poisson is not None and abs(targets.poisson - found.poisson) > tolerance
    if not missed or poisson not in POISSON:
        return ()
    side = "at most" if poisson == POISSON[1] else "at least"
    got, bound = told_apart(targets.poisson, found.poisson)
    return (f"poisson must be {side} {bound}, which bonds give in this mesh, got {got}",)


def _strengths(material, run, targets, tolerance):
    """Material whose specimens show the wanted strengths; matches, and number of runs.

    run: strength of a specimen by the name of a test, a material and the target.
    """
    wanted = {name: getattr(targets, name) for name in TESTS}
    wanted = {name: value for name, value in wanted.items() if value is not None}
    free = {name: field for name, field in _SETS.items() if name in wanted}
    if "tension" in free:
        free.pop("brazilian", None)
    found: dict[str, float] = {}
    history: list[dict[str, tuple[float, float]]] = []
    for _ in range(_ROUNDS if free else 0):
        found = {name: run(name, material, wanted[name]) for name in free}
        history.append({name: (getattr(material, free[name]), found[name]) for name in free})
        apart = [abs(found[name] / wanted[name] - 1.0) for name in free]
        if not max(apart) > 0.5 * tolerance or len(history) == _ROUNDS:
            break
        changed = {free[name]: _next(history, name, wanted[name]) for name in free}
        if not np.isfinite(list(changed.values())).all():
            break
        material = replace(material, **changed)
    runs = len(free) * len(history)
    others = {name: run(name, material, wanted[name]) for name in wanted if name not in free}
    found.update(others)
    matches = tuple(Match(name, wanted[name], found[name], name in free) for name in wanted)
    return material, matches, runs + len(others)


def _next(history, name, target):
    """Constant that is expected to give a strength: by the power law through the last two rounds.

    In proportion after the first, or where the constant hardly changed, as the strength then rather
    follows the other constants. Powers lie from 1/3 to 3, so that noise leads nowhere far. NaN for
    a specimen that showed no strength.
    """
    value, found = history[-1][name]
    if not found > 0.0:
        return math.nan
    power = 1.0
    if len(history) > 1:
        before, shown = history[-2][name]
        if abs(value / before - 1.0) > 0.05:
            power = np.clip(np.log(found / shown) / np.log(value / before), 1.0 / 3.0, 3.0)
    with np.errstate(over="ignore"):
        return float(value * np.float64(target / found) ** (1.0 / power))


def with_moduli(material: Material, normal: float, shear: float) -> Material:
    """The material with other moduli of its bonds [Pa], and dashpots and contacts that follow."""
    changed: dict[str, Any] = {
        "normal_stiffness": ModulusOverDistance(normal),
        "shear_stiffness": ModulusOverDistance(shear),
    }
    moduli = {"normal_damping": normal, "shear_damping": shear}
    moduli.update({"contact_stiffness": normal, "contact_damping": normal})
    for name, modulus in moduli.items():
        rule: Any = getattr(material, name)
        if isinstance(rule, (FaceStiffness, ShareOfCritical, ContactShareOfCritical)):
            changed[name] = replace(rule, modulus=modulus)
    return replace(material, **changed)


def _nominal(material):
    """E [Pa] and nu for which a material was made; InputError for one of constants per area."""
    moduli = material.normal_stiffness, material.shear_stiffness
    if not all(isinstance(rule, ModulusOverDistance) for rule in moduli):
        raise InputError(
            "material must have moduli over the distance of bodies, as Material.from_elastic makes "
            f"it, got {moduli[0]} and {moduli[1]} as its stiffnesses"
        )
    return elastic_constants(*(rule.modulus for rule in moduli))
