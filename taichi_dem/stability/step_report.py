"""Largest stable steps of the bodies of a scene, by criterion and by method, before any run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.elasticity.rates import bond_rates, contact_eigenvalues, dashpots_of, springs_of
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.terminal import aligned
from taichi_dem.kit.validation import instance
from taichi_dem.materials.body_materials import AnyMaterial
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import topology_of
from taichi_dem.scene import Scene, scene_warnings
from taichi_dem.stability.body_limits import LIMITED
from taichi_dem.stability.stable_step import dashpot_step, spring_step

#: Elements listed in the printed table.
WORST = 10
#: Methods by their treatment of dashpots.
METHODS = {
    "full": "Uniform, Multirate",
    "limited": 'the same with dashpot="limited"',
    "solved": "ImplicitDashpots",
}


@dataclass(frozen=True, eq=False)
class StepReport:
    """Largest stable steps of every body by criterion and by method, and which of them binds.

    Parameters
    ----------
    limits : dict
        Largest steps [s] by criterion, shape (body_count,) each: bond_stiffness, bond_dashpot,
        contact_stiffness and contact_dashpot (all of the worst face in one contact). A criterion
        whose effect a scene leaves out is missing.
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
        """Name of the criterion that binds each body's explicit step, array (body_count,).

        "nothing" for a body whose step nothing limits.
        """
        place = np.argmin([*self.limits.values()], axis=0)
        return np.where(np.isfinite(self.step_s), np.array([*self.limits])[place], "nothing")

    def borne(self, dashpots: str, link: str = "bond") -> np.ndarray:
        """Largest stable step of each body under a method.

        A step is stable that is below both that of the bonds and that of the contacts.

        Parameters
        ----------
        dashpots : str
            How the method takes dashpots, a key of ``METHODS``: ``"full"``, ``"limited"`` or
            ``"solved"``, which leaves the limit of the springs.
        link : str, default "bond"
            ``"bond"``, or ``"contact"`` for all of the worst face in one contact.

        Returns
        -------
        ndarray
            Steps [s], shape (body_count,); infinite where nothing limits them.
        """
        none = np.full(len(self.step_s), np.inf)
        springs = self.limits.get(f"{link}_stiffness", none)
        if dashpots == "solved":
            return springs
        together = stable_together(springs, self.limits.get(f"{link}_dashpot", none))
        if dashpots == "full":
            return together
        # Of the stability limit 2 of an explicit step, limited dashpots take at most LIMITED.
        return np.maximum(together, springs * np.sqrt(1.0 - 0.5 * LIMITED))

    def __repr__(self):
        worst = int(np.argmin(self.step_s))
        step = f"smallest step {self.step_s[worst]:.3g} s by {self.binding[worst]}"
        return in_brief(self, counted(len(self.step_s), "body"), step, "print it for the table")

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
            "in contact: all of the worst face at once; Multirate: of the worst body, as "
            "each has its own; a StepControl keeps to its safety's share of them"
        )
        return "\n".join([*lines, *self._worst(), explained, *warnings])

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
            "price: how much larger the step of all would be without this body and those above; "
            f"with steps of their own they take {taken:.3g} % of the updates"
        )
        return [*aligned(rows), "", words]


def stable_together(springs: ArrayLike, drags: ArrayLike) -> np.ndarray:
    """Largest explicit step [s] at which springs and dashpots of a body are stable together.

    springs, drags: largest steps of each alone [s], ``spring_step`` and ``dashpot_step``.
    The leapfrog whose dashpots take the velocity of half a step ago, v += -dt (w^2 x + c v), is
    stable while c dt + (w dt)^2 / 2 <= 2, which is dt / drags + (dt / springs)^2 <= 1.
    """
    with np.errstate(divide="ignore"):
        rate = 1.0 / np.asarray(drags)
        return 2.0 / (rate + np.sqrt(rate**2 + (2.0 / np.asarray(springs)) ** 2))


def step_report(scene: Scene) -> StepReport:
    """Judge the steps of a scene before a run.

    Parameters
    ----------
    scene : Scene
        Scene to judge.

    Returns
    -------
    StepReport
        Largest stable step of each body by criterion and method. Print it for a table.

    Raises
    ------
    InputError
        The argument is no Scene.

    Notes
    -----
    Limits hold for a pair of equal bodies that move against each other: no mesh has a smaller
    limit, and none more than twice the limit. Of contacts with bodies of several materials the
    stiffest counts.

    Examples
    --------
    >>> print(step_report(Scene(read_mesh(PAPER_BLOCK), CONCRETE)))  # doctest: +SKIP
    """
    mesh, material = instance("scene", scene, Scene).mesh, scene.body_materials
    damped, friction, contact = map(scene.effect, ("dashpot", "friction", "contact"))
    limits = bond_steps(mesh, material)
    if not damped:
        del limits["bond_dashpot"]
    if contact is not None:
        stiffness, damping = map(material.of_contacts, contact.constants)
        _, whole_face = contact_eigenvalues(mesh, material.density, contact.divisions, friction)
        whole_face = whole_face * contact.areas(mesh)
        limits["contact_stiffness"] = spring_step(stiffness * whole_face)
        limits["contact_dashpot"] = dashpot_step(damping * whole_face)
    vectors = geometry.area_vectors(mesh.points, geometry.all_faces(mesh.tetrahedra))
    volume = geometry.signed_volumes(mesh.points, mesh.tetrahedra)
    altitude = 3.0 * volume / np.linalg.norm(vectors, axis=1).reshape(-1, 4).max(axis=1)
    longest = geometry.edge_lengths(mesh.points, mesh.tetrahedra).max(axis=1)
    return StepReport(limits, altitude, longest / altitude, scene_warnings(scene))


def bond_steps(mesh: Mesh, material: AnyMaterial) -> dict[str, np.ndarray]:
    """Largest steps [s] that the springs and the dashpots of the bonds of each body allow."""
    of_bonds = mesh, topology_of(mesh), material.density
    return {
        "bond_stiffness": spring_step(bond_rates(*of_bonds, springs_of(material))),
        "bond_dashpot": dashpot_step(bond_rates(*of_bonds, dashpots_of(material))),
    }
