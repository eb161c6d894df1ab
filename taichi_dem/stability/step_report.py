"""Limits of the step for a mesh and material, by method and element, before any run."""

from dataclasses import dataclass
from typing import Optional, Union

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.elasticity.rates import (
    bond_rates,
    dashpots_of,
    inverse_root,
    point_blocks,
    scaled_eigenvalues,
    springs_of,
)
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length
from taichi_dem.kit.validation import shown, whole
from taichi_dem.materials import Material
from taichi_dem.materials.body_materials import laid_out
from taichi_dem.mesh.contact_spheres import spheres_of_faces
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors
from taichi_dem.mesh.topology import Density, body_properties, topology_of
from taichi_dem.scene import Scene, scene_warnings
from taichi_dem.stability.body_limits import LIMITED
from taichi_dem.stability.stable_step import dashpot_step, spring_step
from taichi_dem.step_control import StepControl

#: Elements listed in the printed table.
_WORST = 10
#: Criterion of a body without bonds and contacts.
NOTHING = "nothing"
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
        contact_stiffness and contact_dashpot (every sphere of the worst face in one contact),
        contact_dashpot_single (one sphere in contact, which binds nothing by itself). A criterion
        whose effect a scene leaves out is missing.
    warnings : tuple of str, default ()
        Sentences about the scene.
    """

    limits: dict[str, np.ndarray]
    warnings: tuple[str, ...] = ()

    @property
    def binding(self) -> np.ndarray:
        """Name of the criterion that binds each body's explicit step, array (body_count,).

        "nothing" for a body whose step nothing limits.
        """
        names = self._names()
        place = np.argmin([self.limits[name] for name in names], axis=0)
        return np.where(np.isfinite(self.step_s), np.array(names)[place], NOTHING)

    @property
    def step_s(self) -> np.ndarray:
        """Smallest of the limits of each body [s], (body_count,)."""
        return np.min([self.limits[name] for name in self._names()], axis=0)

    def _names(self):
        return [name for name in self.limits if not name.endswith("single")]

    def borne(self, dashpots: str, link: str = "bond") -> np.ndarray:
        """Largest stable step of each body under a method.

        A step is stable that is below both that of the bonds and that of the contacts.

        Parameters
        ----------
        dashpots : str
            How the method takes dashpots, a key of ``METHODS``: ``"full"``, ``"limited"`` or
            ``"solved"``, which leaves the limit of the springs.
        link : str, default "bond"
            ``"bond"``, or ``"contact"`` for every sphere of the worst face in one contact.

        Returns
        -------
        ndarray
            Steps [s], shape (body_count,); infinite where nothing limits them.
        """
        springs = self.limits.get(f"{link}_stiffness")
        if springs is None:
            return np.full(len(self.limits["bond_stiffness"]), np.inf)
        drags = self.limits.get(f"{link}_dashpot", np.full(len(springs), np.inf))
        if dashpots == "solved":
            return springs
        together = stable_together(springs, drags)
        if dashpots == "full":
            return together
        # Of the stability limit 2 of an explicit step, limited dashpots take at most LIMITED.
        return np.maximum(together, springs * np.sqrt(1.0 - 0.5 * LIMITED))

    def worst(self, count: int = _WORST) -> np.ndarray:
        """Bodies of the smallest step, the worst first.

        Parameters
        ----------
        count : int, default _WORST
            How many.

        Returns
        -------
        ndarray
            Numbers of the bodies, shape (count,).
        """
        whole("count", count, 0, 2**31 - 1)
        return np.argsort(self.step_s, kind="stable")[:count]

    def price(self, count: int = _WORST) -> float:
        """Gain in the step of all without the count worst bodies.

        Parameters
        ----------
        count : int, default _WORST
            How many.

        Returns
        -------
        float
            Factor of at least 1; infinite where nothing limits the step of the others.
        """
        whole("count", count, 0, 2**31 - 1)
        steps = np.append(np.sort(self.step_s), np.inf)
        return float(steps[min(count, len(steps) - 1)] / steps[0]) if steps[0] < np.inf else 1.0

    def work_share(self, count: int = _WORST) -> float:
        """Share of the body updates, each at its own step, that the worst bodies take.

        Parameters
        ----------
        count : int, default _WORST
            How many.

        Returns
        -------
        float
            Share, from 0 to 1.
        """
        updates = 1.0 / self.step_s
        return float(updates[self.worst(count)].sum() / max(updates.sum(), 1e-300))

    def __repr__(self):
        worst = self.worst(1)[0]
        step = f"smallest step {self.step_s[worst]:.3g} s by {self.binding[worst]}"
        if self._free:
            step = "nothing limits the step"
        bodies = counted(len(self.step_s), "body")
        return in_brief(self, bodies, step, "print it for the table")

    def __str__(self):
        """Steps by method, numbers of bodies by criterion, the worst bodies and their cost."""
        lines = [*self._method_lines(), "", *self._criterion_lines(), *self._worst_lines()]
        if self._free:
            lines = ["nothing limits the step: no body has a bond, and no contact is listed"]
        return "\n".join([*lines, *(f"warning: {warning}" for warning in self.warnings)])

    @property
    def _free(self):
        """Whether nothing limits the step of any body."""
        return not np.isfinite(self.step_s).any()

    def _method_lines(self):
        """A line for every treatment of dashpots, then an explanation."""
        lines = [f"{'largest stable step':32s}{'in bonds s':>12s}{'':10s}{'in contact s':>14s}"]
        for dashpots, words in METHODS.items():
            bonds, contact = (self._smallest(dashpots, link) for link in ("bond", "contact"))
            lines.append(
                f"{words:32s}{_seconds(bonds[0]):>12s} {bonds[1]:9s}"
                f"{_seconds(contact[0]):>14s} {contact[1]}"
            )
        lines.append(
            "in contact: every sphere of the worst face at once; Multirate: of the worst body, "
            f"each has its own; control=StepControl() keeps to {StepControl().safety:g} of them"
        )
        return lines

    def _smallest(self, dashpots, link):
        """Largest stable step of a method [s], and whether springs or dashpots limit it."""
        steps = self.borne(dashpots, link)
        body = int(np.argmin(steps))
        if not np.isfinite(steps[body]):
            return np.inf, ""
        drags = self.limits.get(f"{link}_dashpot", np.full(len(steps), np.inf))[body]
        strict = dashpots == "full" and drags < self.limits[f"{link}_stiffness"][body]
        return steps[body], "dashpots" if strict else "springs"

    def _criterion_lines(self):
        binding, head = self.binding, "explicit step bound by"
        lines = [f"{head:24s}{'bodies':>8s}{'smallest s':>12s}{'median s':>12s}"]
        for name, values in self.limits.items():
            bodies = int((binding == name).sum())
            smallest, median = (_seconds(value) for value in (values.min(), np.median(values)))
            lines.append(f"{name:24s}{bodies:8d}{smallest:>12s}{median:>12s}")
        return lines

    def _worst_lines(self):
        """The bodies of the smallest steps, as far as something limits them, and their cost."""
        binding, step = self.binding, self.step_s
        worst = [body for body in self.worst() if np.isfinite(step[body])]
        lines = [f"{'worst body':>10s}{'step s':>12s}  bound by"]
        lines += [f"{body:10d}{step[body]:12.3g}  {binding[body]}" for body in worst]
        return [*lines, *self._price_lines()]

    def _price_lines(self):
        """Cost of the worst bodies, where the step of others is limited too."""
        price = self.price()
        if not np.isfinite(price):
            return []
        share = f"with steps of their own they take {100 * self.work_share():.3g} % of the updates"
        if f"{price:.3g}" == "1":
            return [f"without the worst {_WORST} the step of all would be no longer; {share}"]
        longer = f"would be {price:.3g} times longer"
        return [f"without the worst {_WORST} the step of all {longer}; {share}"]


def _seconds(step):
    """A step [s] for a table."""
    return f"{step:.3g}" if np.isfinite(step) else "unlimited"


def stable_together(springs: ArrayLike, drags: ArrayLike) -> np.ndarray:
    """Largest explicit step [s] at which springs and dashpots of a body are stable together.

    springs, drags: largest steps of each alone [s], ``spring_step`` and ``dashpot_step``.
    The leapfrog whose dashpots take the velocity of half a step ago, v += -dt (w^2 x + c v), is
    stable while c dt + (w dt)^2 / 2 <= 2, which is dt / drags + (dt / springs)^2 <= 1.
    """
    with np.errstate(divide="ignore"):
        rate = 1.0 / np.asarray(drags)
        return 2.0 / (rate + np.sqrt(rate**2 + (2.0 / np.asarray(springs)) ** 2))


def step_report(scene: Union[Scene, Mesh], material: Optional[Material] = None) -> StepReport:
    """Judge a scene, or a mesh and a material with all effects, before a run.

    Parameters
    ----------
    scene : Scene or Mesh
        Scene, or a Mesh where a material is given.
    material : Material, optional
        Material of a mesh.

    Returns
    -------
    StepReport
        Largest stable step of each body by criterion and method. Print it for a table.

    Raises
    ------
    InputError
        The arguments are of another kind.

    Notes
    -----
    Limits hold for a pair of equal bodies that move against each other: no mesh has a smaller
    limit, and none more than twice the limit. Of contacts with bodies of several materials the
    stiffest counts.

    Examples
    --------
    >>> print(step_report(read_mesh(PAPER_BLOCK), CONCRETE))  # doctest: +SKIP
    """
    if isinstance(scene, Scene) and material is None:
        damped, friction, contact = map(scene.effect, ("dashpot", "friction", "contact"))
        divisions = contact.divisions if contact is not None else None
        warnings = scene_warnings(scene)
        return _report(scene.mesh, scene.body_materials, damped, friction, divisions, warnings)
    if isinstance(scene, Mesh) and isinstance(material, Material):
        return _report(scene, material, True, True, 5)
    raise InputError(
        f"scene must be a Scene, or a Mesh with a Material as material, got {shown(scene)} and "
        f"{shown(material)}"
    )


def _report(mesh, material, damped, friction, divisions, warnings=()):
    topology, material = topology_of(mesh), laid_out(mesh, material)
    rates = bond_rates(mesh, topology, material.density, springs_of(material))
    limits = {"bond_stiffness": spring_step(rates)}
    if damped:
        rates = bond_rates(mesh, topology, material.density, dashpots_of(material))
        limits["bond_dashpot"] = dashpot_step(rates)
    if divisions is not None:
        stiffness, damping = map(material.of_contacts, ("contact_stiffness", "contact_damping"))
        one, whole = contact_eigenvalues(mesh, material.density, divisions, friction)
        limits["contact_stiffness"] = spring_step(stiffness * whole)
        limits["contact_dashpot"] = dashpot_step(damping * whole)
        limits["contact_dashpot_single"] = dashpot_step(damping * one)
    return StepReport(limits, warnings)


def contact_eigenvalues(
    mesh: Mesh, density: Density, divisions: int, friction: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Largest eigenvalues of M^-1/2 (J^T D J) M^-1/2 of each body [1/kg], two arrays (n,).

    The first is for the worst of its spheres in contact, the second for all of the worst face. D is
    the identity with friction, n n^T without; contacts act where a sphere touches its face. The
    step finds the same from the near contacts (``stability/contact_limits.py``).
    """
    mass, centre, inertia = body_properties(mesh, density)
    spheres = spheres_of_faces(mesh, centre, divisions)
    root = inverse_root(mass, inertia)
    one, whole = np.zeros(len(mass)), np.zeros(len(mass))
    for face in range(4):
        outward = _outward(mesh, face)
        arms = spheres.centre[:, face] + spheres.radius[:, face, :, None] * outward[:, None]
        along = outward[:, :, None] * outward[:, None, :]
        law = np.broadcast_to(np.eye(3), along.shape) if friction else along
        whole = np.maximum(whole, _largest(root, point_blocks(arms, law)))
        for k in range(spheres.per_face):
            one = np.maximum(one, _largest(root, point_blocks(arms[:, k : k + 1], law)))
    return one, whole


def _outward(mesh, face):
    """Outward unit normals of local face of every body, (n, 3)."""
    vector = area_vectors(mesh.points, all_faces(mesh.tetrahedra).reshape(-1, 4, 3)[:, face])
    return vector / length(vector)[:, None]


def _largest(root, blocks):
    return scaled_eigenvalues(root, blocks)
