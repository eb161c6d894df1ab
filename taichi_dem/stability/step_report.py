"""Stable steps, elastic constants and crack resolution of a scene, before a run."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.elasticity.mesh_stiffness import MeshStiffness, mesh_stiffness
from taichi_dem.elasticity.rates import bond_rates, contact_eigenvalues, dashpots_of, springs_of
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.terminal import aligned
from taichi_dem.kit.validation import instance
from taichi_dem.materials import Material
from taichi_dem.materials.body_materials import AnyMaterial, BodyMaterials
from taichi_dem.materials.bond_rules import ModulusOverDistance
from taichi_dem.materials.material import elastic_constants
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh, element_sizes
from taichi_dem.mesh.topology import topology_of
from taichi_dem.scene import Scene, scene_warnings
from taichi_dem.stability.body_limits import LIMITED, dashpot_step, spring_step

#: Elements listed in the printed table.
WORST = 10
#: Methods by their treatment of dashpots.
METHODS = {
    "full": "Uniform, Multirate",
    "limited": 'the same with dashpot="limited"',
    "solved": "ImplicitDashpots",
}
#: Elements in a characteristic length below which cracks are those of the mesh.
ELEMENTS = 4.0


@dataclass(frozen=True, eq=False)
class StepReport:
    """Largest stable steps of every body by criterion and by method, and which of them binds.

    Parameters
    ----------
    limits : dict
        Largest steps [s] by criterion, shape (body_count,) each: bond_stiffness, bond_dashpot,
        contact_stiffness and contact_dashpot (all of the worst face in one contact).
    altitude_m : ndarray
        Smallest altitude of each body [m], (body_count,).
    aspect_ratio : ndarray
        Longest edge over smallest altitude [-]; 1.22 for a regular tetrahedron.
    warnings : tuple of str
        Sentences about the scene.
    """

    limits: dict[str, np.ndarray]
    altitude_m: np.ndarray
    aspect_ratio: np.ndarray
    warnings: tuple[str, ...]

    @property
    def step_s(self) -> np.ndarray:
        """Smallest of the limits of each body [s], (body_count,)."""
        return np.min([*self.limits.values()], axis=0)

    @property
    def binding(self) -> np.ndarray:
        """Criterion that binds the explicit step of each body, (body_count,); or "nothing"."""
        place = np.argmin([*self.limits.values()], axis=0)
        return np.where(np.isfinite(self.step_s), np.array([*self.limits])[place], "nothing")

    def borne(self, dashpots: str, link: str = "bond") -> np.ndarray:
        """Largest stable step [s] of each body under a method; infinite where nothing limits it.

        A step is stable that is below both that of the bonds and that of the contacts.

        Parameters
        ----------
        dashpots : str
            How the method takes dashpots: ``"full"``, ``"limited"`` or ``"solved"``.
        link : str, default "bond"
            ``"bond"``, or ``"contact"`` for all of the worst face in one contact.
        """
        return stable_steps(self.limits, dashpots, link)

    def __str__(self):
        """Steps by method, numbers of bodies by criterion, the worst bodies and their cost."""
        warnings = [f"warning: {warning}" for warning in self.warnings]
        if not np.isfinite(self.step_s).any():
            words = "nothing limits the step: no body has a bond, and no contact is listed"
            return "\n".join([words, *warnings])
        methods = [["largest stable step", "in bonds s", "in contact s"]]
        for dashpots, words in METHODS.items():
            bond, contact = (self.borne(dashpots, link).min() for link in ("bond", "contact"))
            methods.append([words, f"{bond:.3g}", f"{contact:.3g}"])
        binding = self.binding
        criteria = [["step bound by", "bodies", "smallest s", "median s"]]
        for name, own in self.limits.items():
            figures = f"{own.min():.3g}", f"{np.median(own):.3g}"
            criteria.append([name, f"{(binding == name).sum()}", *figures])
        lines = [line for table in (methods, criteria) for line in [*aligned(table), ""]]
        explained = (
            "in contact: if all contacts of the worst face act at once; Multirate takes this step "
            "for the worst body alone, StepControl its safety's share"
        )
        return "\n".join([*lines, *self._worst(), explained, *warnings])

    __repr__ = __str__

    def _worst(self):
        """Lines about the bodies of the smallest steps, and what they cost."""
        step, binding = self.step_s, self.binding
        order = np.argsort(step, kind="stable")
        prices = np.append(step[order], np.inf)[1:] / step[order[0]]
        rows = [["worst body", "step s", "bound by", "altitude m", "aspect", "price"]]
        for body, price in zip(order[:WORST], prices):
            shape = f"{self.altitude_m[body]:.3g}", f"{self.aspect_ratio[body]:.3g}"
            rows.append([f"{body}", f"{step[body]:.3g}", binding[body], *shape, f"{price:.3g}"])
        taken = 100.0 * float((1.0 / step[order[:WORST]]).sum() / (1.0 / step).sum())
        words = (
            "price: how many times longer the common step could be without this body and those "
            f"above; if each has its own step, they take {taken:.3g} % of the updates"
        )
        return [*aligned(rows), "", words]


def stable_steps(limits: dict[str, np.ndarray], dashpots: str, link: str = "bond") -> np.ndarray:
    """Largest stable step of each body [s], see ``StepReport.borne``; limits: by criterion."""
    none = np.full(len(limits["bond_stiffness"]), np.inf)
    springs = limits.get(f"{link}_stiffness", none)
    if dashpots == "solved":
        return springs
    together = stable_together(springs, limits.get(f"{link}_dashpot", none))
    if dashpots == "full":
        return together
    # Of the stability limit 2 of an explicit step, limited dashpots take at most LIMITED.
    return np.maximum(together, springs * np.sqrt(1.0 - 0.5 * LIMITED))


def stable_together(springs: ArrayLike, drags: ArrayLike) -> np.ndarray:
    """Largest explicit step [s] at which springs and dashpots of a body are stable together."""
    # v += -dt (w^2 x + c v) with v of half a step ago is stable while c dt + (w dt)^2 / 2 <= 2,
    # which is dt / drags + (dt / springs)^2 <= 1.
    with np.errstate(divide="ignore"):
        rate = 1.0 / np.asarray(drags)
        return 2.0 / (rate + np.sqrt(rate**2 + (2.0 / np.asarray(springs)) ** 2))


def step_report(scene: Scene) -> StepReport:
    """Judge the steps of a scene before a run.

    Parameters
    ----------
    scene : Scene
        Scene to judge.

    Notes
    -----
    Limits hold for a pair of equal bodies that move against each other: no mesh has a smaller
    limit, and none more than twice. Of contacts with several materials the stiffest counts.
    """
    mesh, material = instance("scene", scene, Scene).mesh, scene.body_materials
    effects = map(scene.effect, ("dashpot", "friction", "contact"))
    limits = step_limits(mesh, material, *effects)
    vectors = geometry.area_vectors(mesh.points, geometry.all_faces(mesh.tetrahedra))
    volume = geometry.signed_volumes(mesh.points, mesh.tetrahedra)
    altitude = 3.0 * volume / np.linalg.norm(vectors, axis=1).reshape(-1, 4).max(axis=1)
    longest = geometry.edge_lengths(mesh.points, mesh.tetrahedra).max(axis=1)
    return StepReport(limits, altitude, longest / altitude, scene_warnings(scene))


def step_limits(
    mesh: Mesh,
    material: BodyMaterials,
    dashpot: Any,
    friction: Any,
    contact: Any,
    rates: Callable = bond_rates,
    eigenvalues: Callable = contact_eigenvalues,
) -> dict[str, np.ndarray]:
    """Largest steps [s] of each body by criterion; dashpot, friction, contact: effects or None."""
    limits = bond_steps(mesh, material, rates, bool(dashpot))
    if contact is not None:
        stiffness, damping = contact.strongest(mesh, material)
        of_faces = mesh, material.density, contact.geometry.divisions, bool(friction)
        whole_face = eigenvalues(*of_faces)
        limits["contact_stiffness"] = spring_step(stiffness * whole_face)
        limits["contact_dashpot"] = dashpot_step(damping * whole_face)
    return limits


def bond_steps(
    mesh: Mesh, material: AnyMaterial, rates: Callable = bond_rates, damped: bool = True
) -> dict[str, np.ndarray]:
    """Largest steps [s] that the springs and the dashpots of the bonds of each body allow."""
    of_bonds = mesh, topology_of(mesh), material.density
    steps = {"bond_stiffness": spring_step(rates(*of_bonds, springs_of(material)))}
    if damped:
        steps["bond_dashpot"] = dashpot_step(rates(*of_bonds, dashpots_of(material)))
    return steps


@dataclass(frozen=True, eq=False)
class ElasticReport:
    """Elastic constants of a scene's mesh beside those asked for, and crack resolution.

    Parameters
    ----------
    stiffness : MeshStiffness
        Elastic constants of the block that the mesh is.
    asked : tuple of (float, float) or None
        Young's modulus [Pa] and Poisson's ratio of the one material, if made from them; else None.
    crack_length : ndarray
        Characteristic length E G_f / tensile_strength^2 of the tip of a crack [m] at each body,
        (body_count,); with several materials by the E of a mesh of the body's material alone.
    element_size : ndarray
        Edge of the regular tetrahedron of the volume of each body [m], shape (body_count,).
    steps : StepReport
        Largest stable steps.
    """

    stiffness: MeshStiffness
    asked: tuple[float, float] | None
    crack_length: np.ndarray
    element_size: np.ndarray
    steps: StepReport

    @property
    def elements(self) -> np.ndarray:
        """Elements in a characteristic length at each body, (body_count,)."""
        return self.crack_length / self.element_size

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence where elements are too large for cracks; ``steps`` has its own warnings."""
        coarse = int((self.elements < ELEMENTS).sum())
        words = (
            f"the characteristic length E G_f / tensile_strength^2 = {self._crack_words()} m is "
            f"less than {ELEMENTS:g} elements at {coarse} of {len(self.element_size)} bodies, with "
            f"edges of up to {self.element_size.max():.3g} m: there the mesh determines strength "
            "and crack paths"
        )
        return (words,) if coarse else ()

    def _crack_words(self):
        """The characteristic length, or the range of several, as a number for a sentence."""
        ends = np.unique([np.min(self.crack_length), np.max(self.crack_length)])
        return " to ".join(f"{length:.3g}" for length in ends)

    def __str__(self):
        """Elastic constants, wave speeds, elements in a characteristic length, warnings, steps."""
        lines = [str(self.stiffness)]
        if self.asked:
            young, poisson = self.asked
            lines.insert(0, f"asked for: E {young * 1e-9:.4g} GPa, nu {poisson:.3f}")
        fewest, median = self.elements.min(), float(np.median(self.elements))
        lines.append(
            f"characteristic length of cracks {self._crack_words()} m: {fewest:.2g} of the "
            f"largest element, {median:.2g} of the median one"
        )
        lines += [f"warning: {words}" for words in self.warnings]
        return "\n".join([*lines, str(self.steps)])

    __repr__ = __str__


def elastic_report(scene: Scene) -> ElasticReport:
    """Elastic constants of the mesh of a scene with its material; print it before a run.

    Parameters
    ----------
    scene : Scene
        Scene to judge.

    Notes
    -----
    Six linear static solves of the whole mesh: some seconds for ten thousand bodies. With several
    materials those of the block that they make together, and six solves more for each.
    """
    instance("scene", scene, Scene)
    mesh, laid = scene.mesh, scene.body_materials
    stiffness = mesh_stiffness(mesh, laid)
    steps, sizes = step_report(scene), element_sizes(mesh)
    alone, asked = [stiffness], _asked(laid.materials[0])
    if not laid.is_one:
        alone, asked = [mesh_stiffness(mesh, each) for each in laid.materials], None
    pairs = zip(alone, laid.materials)
    lengths = [
        own.young * material.fracture_energy / material.tensile_strength**2
        for own, material in pairs
    ]
    return ElasticReport(stiffness, asked, np.array(lengths)[laid.of_body], sizes, steps)


def _asked(material: Material) -> tuple[float, float] | None:
    """E [Pa] and Poisson's ratio for which a material was made, None where it names none."""
    normal, shear = material.normal_stiffness, material.shear_stiffness
    if isinstance(normal, ModulusOverDistance) and isinstance(shear, ModulusOverDistance):
        with contextlib.suppress(InputError):
            return elastic_constants(normal.modulus, shear.modulus)
    return None
