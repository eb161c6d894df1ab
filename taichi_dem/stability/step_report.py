"""Largest stable steps of the bodies of a scene, by criterion and by method, before any run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.elasticity.rates import bond_rates, contact_eigenvalues, dashpots_of, springs_of
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.terminal import aligned
from taichi_dem.kit.validation import instance, whole
from taichi_dem.materials.body_materials import AnyMaterial
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
        contact_stiffness and contact_dashpot (every sphere of the worst face in one contact),
        contact_dashpot_single (one sphere in contact, which binds nothing by itself). A criterion
        whose effect a scene leaves out is missing.
    warnings : tuple of str
        Sentences about the scene.
    """

    limits: dict[str, np.ndarray]
    warnings: tuple[str, ...]

    @property
    def _strict(self):
        """The limits that bind a step."""
        return {name: steps for name, steps in self.limits.items() if not name.endswith("single")}

    @property
    def step_s(self) -> np.ndarray:
        """Smallest of the limits of each body [s], (body_count,)."""
        return np.min([*self._strict.values()], axis=0)

    @property
    def binding(self) -> np.ndarray:
        """Name of the criterion that binds each body's explicit step, array (body_count,).

        "nothing" for a body whose step nothing limits.
        """
        place = np.argmin([*self._strict.values()], axis=0)
        return np.where(np.isfinite(self.step_s), np.array([*self._strict])[place], "nothing")

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
        none = np.full(len(self.step_s), np.inf)
        springs = self.limits.get(f"{link}_stiffness", none)
        if dashpots == "solved":
            return springs
        together = stable_together(springs, self.limits.get(f"{link}_dashpot", none))
        if dashpots == "full":
            return together
        # Of the stability limit 2 of an explicit step, limited dashpots take at most LIMITED.
        return np.maximum(together, springs * np.sqrt(1.0 - 0.5 * LIMITED))

    def worst(self, count: int = WORST) -> np.ndarray:
        """Bodies of the smallest step, the worst first.

        Parameters
        ----------
        count : int, default WORST
            How many.

        Returns
        -------
        ndarray
            Numbers of the bodies, shape (count,).
        """
        return np.argsort(self.step_s, kind="stable")[: whole("count", count, 0, 2**31 - 1)]

    def price(self, count: int = WORST) -> np.ndarray:
        """Gain in the step of all without the k + 1 worst bodies, k < count.

        Parameters
        ----------
        count : int, default WORST
            How many.

        Returns
        -------
        ndarray
            Factors of at least 1, as many as there are bodies to leave out; infinite where nothing
            else limits the step, 1 where nothing limited it before.
        """
        steps = np.append(self.step_s[self.worst(len(self.step_s))], np.inf)
        gained = steps[1 : whole("count", count, 0, 2**31 - 1) + 1]
        return gained / steps[0] if np.isfinite(steps[0]) else np.ones_like(gained)

    def __repr__(self):
        worst = self.worst(1)[0]
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
        step, binding = self.step_s, self.binding
        criteria = [["step bound by", "bodies", "smallest s", "median s"]]
        for name, own in self.limits.items():
            figures = f"{own.min():.3g}", f"{np.median(own):.3g}"
            criteria.append([name, f"{(binding == name).sum()}", *figures])
        worst = [["worst body", "step s", "bound by"]]
        worst += [[f"{body}", f"{step[body]:.3g}", binding[body]] for body in self.worst()]
        lines = [line for table in (methods, criteria, worst) for line in [*aligned(table), ""]]
        explained = (
            "in contact: every sphere of the worst face at once; Multirate: of the worst body, as "
            "each has its own; a StepControl keeps to its safety's share of them"
        )
        return "\n".join([*lines, explained, *self._prices(), *warnings])

    def _prices(self):
        """Cost of the worst bodies, where the step of others is limited too."""
        price = self.price()[-1]
        updates = 1.0 / self.step_s
        taken = float(updates[self.worst()].sum() / max(updates.sum(), 1e-300))
        share = f"{100 * taken:.3g} % of the updates"
        words = f"without the worst {WORST} the step of all would be {price:.3g} times as long"
        return [f"{words}; with steps of their own they take {share}"] if price < np.inf else []


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
        stiffness, damping = map(material.of_contacts, ("contact_stiffness", "contact_damping"))
        one, whole_face = contact_eigenvalues(mesh, material.density, contact.divisions, friction)
        limits["contact_stiffness"] = spring_step(stiffness * whole_face)
        limits["contact_dashpot"] = dashpot_step(damping * whole_face)
        limits["contact_dashpot_single"] = dashpot_step(damping * one)
    return StepReport(limits, scene_warnings(scene))


def bond_steps(mesh: Mesh, material: AnyMaterial) -> dict[str, np.ndarray]:
    """Largest steps [s] that the springs and the dashpots of the bonds of each body allow."""
    of_bonds = mesh, topology_of(mesh), material.density
    return {
        "bond_stiffness": spring_step(bond_rates(*of_bonds, springs_of(material))),
        "bond_dashpot": dashpot_step(bond_rates(*of_bonds, dashpots_of(material))),
    }
