"""Quality of the elements of a mesh, and the cost of bad ones in time step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_dem.elasticity.rates import (
    bond_rates,
    dashpots_of,
    springs_of,
)
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.validation import instance, whole
from taichi_dem.materials import Material
from taichi_dem.materials.body_materials import AnyMaterial, BodyMaterials
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import body_properties, topology_of
from taichi_dem.stability.stable_step import dashpot_step, spring_step

#: Elements listed in the printed table.
_WORST = 10


@dataclass(frozen=True, eq=False)
class QualityReport:
    """Quality of each body, arrays (body_count,), and the explicit steps that follow.

    Parameters
    ----------
    volume_m3 : ndarray
        Volumes [m^3], shape (body_count,), as all arrays.
    mass_kg : ndarray
        Masses [kg].
    aspect_ratio : ndarray
        Longest edge over smallest altitude [-]; 1.22 for a regular tetrahedron.
    smallest_altitude_m : ndarray
        Smallest altitudes [m].
    dashpot_step_s : ndarray
        Largest explicit step at which a pair of two such bodies is stable with its bond dashpots
        [s].
    spring_step_s : ndarray
        The same with its bond springs [s].
    point_count : int
        Number of points of the mesh.
    bond_count : int
        Number of bonds.
    outer_count : int
        Number of outer faces.
    """

    volume_m3: np.ndarray
    mass_kg: np.ndarray
    aspect_ratio: np.ndarray
    smallest_altitude_m: np.ndarray
    dashpot_step_s: np.ndarray
    spring_step_s: np.ndarray
    point_count: int
    bond_count: int
    outer_count: int

    @property
    def body_count(self) -> int:
        """Number of bodies."""
        return len(self.volume_m3)

    @property
    def critical_step_s(self) -> np.ndarray:
        """The smaller of both limits of every body [s], shape (body_count,)."""
        return np.minimum(self.dashpot_step_s, self.spring_step_s)

    def worst(self, count: int = _WORST) -> np.ndarray:
        """Bodies of the smallest critical step, the worst first.

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
        return np.argsort(self.critical_step_s, kind="stable")[:count]

    def price(self, count: int = _WORST) -> np.ndarray:
        """Gain in the step of the whole mesh without the k + 1 worst bodies, k < count.

        Parameters
        ----------
        count : int, default _WORST
            How many.

        Returns
        -------
        ndarray
            Factors of at least 1, as many as there are bodies to leave out; infinite where nothing
            else limits the step, 1 where nothing limited it before.
        """
        steps = np.append(np.sort(self.critical_step_s), np.inf)
        gained = steps[1 : whole("count", count, 0, 2**31 - 1) + 1]
        return gained / steps[0] if np.isfinite(steps[0]) else np.ones_like(gained)

    def __repr__(self) -> str:
        bodies, bonds = counted(self.body_count, "body"), counted(self.bond_count, "bond")
        step = f"critical step {self.critical_step_s.min(initial=np.inf):.3g} s"
        return in_brief(self, bodies, bonds, step, "print it for the table")

    def __str__(self) -> str:
        """Counts, ranges and the worst bodies as a table."""
        return "\n".join([*self._summary(), "", *self._worst_lines()])

    def _summary(self):
        """Counts, ranges and limits."""
        ranges = (
            ("smallest altitude", self.smallest_altitude_m, "m"),
            ("mass", self.mass_kg, "kg"),
            ("aspect ratio", self.aspect_ratio, ""),
            ("bond dashpot step", self.dashpot_step_s, "s"),
            ("bond spring step", self.spring_step_s, "s"),
        )
        lines = [
            f"{self.body_count} bodies, {self.point_count} points, {self.bond_count} bonds, "
            f"{self.outer_count} outer faces, volume {self.volume_m3.sum():.6g} m3",
            f"{'':20s}{'smallest':>12s}{'median':>12s}{'largest':>12s}",
        ]
        for name, values, unit in ranges:
            figures = (values.min(), np.median(values), values.max())
            cells = "".join(f"{figure:12.3g}" for figure in figures)
            lines.append(f"{name:20s}{cells} {unit}".rstrip())
        return lines

    def _worst_lines(self):
        """The worst bodies, and the gain in step without them."""
        lines = [
            "worst bodies; the last column is how much larger the step of the whole mesh would be",
            "without this body and those above it",
            f"{'body':>8s}{'altitude m':>12s}{'aspect':>8s}{'dashpot s':>12s}{'spring s':>12s}"
            f"{'price':>8s}",
        ]
        for body, price in zip(self.worst(), self.price()):
            lines.append(
                f"{body:8d}{self.smallest_altitude_m[body]:12.3g}{self.aspect_ratio[body]:8.3g}"
                f"{self.dashpot_step_s[body]:12.3g}{self.spring_step_s[body]:12.3g}{price:8.3f}"
            )
        return lines


def quality_report(mesh: Mesh, material: AnyMaterial) -> QualityReport:
    """Shape and explicit step limits of every body of a mesh.

    Parameters
    ----------
    mesh : Mesh
        Mesh.
    material : Material or BodyMaterials
        Material of the bonds, or those of a scene, ``Scene.body_materials``.

    Returns
    -------
    QualityReport
        Arrays (body_count,); limits are infinite for a body without bonds. Print it for a table.

    Raises
    ------
    InputError
        The arguments are no mesh and material.

    Examples
    --------
    >>> print(quality_report(read_mesh(PAPER_BLOCK), CONCRETE))  # doctest: +SKIP
    """
    instance("mesh", mesh, Mesh)
    instance("material", material, (Material, BodyMaterials))
    topology = topology_of(mesh)
    mass, _, _ = body_properties(mesh, material.density)
    altitude = smallest_altitudes(mesh)
    longest = geometry.edge_lengths(mesh.points, mesh.tetrahedra).max(axis=1)
    damping = bond_rates(mesh, topology, material.density, dashpots_of(material))
    springs = bond_rates(mesh, topology, material.density, springs_of(material))
    return QualityReport(
        volume_m3=geometry.signed_volumes(mesh.points, mesh.tetrahedra),
        mass_kg=mass,
        aspect_ratio=longest / altitude,
        smallest_altitude_m=altitude,
        dashpot_step_s=dashpot_step(damping),
        spring_step_s=spring_step(springs),
        point_count=mesh.point_count,
        bond_count=topology.bond_count,
        outer_count=topology.outer_count,
    )


def smallest_altitudes(mesh: Mesh) -> np.ndarray:
    """Smallest distance of a vertex from the opposite face, 3 V / A [m], shape (body_count,)."""
    vectors = geometry.area_vectors(mesh.points, geometry.all_faces(mesh.tetrahedra))
    area = np.linalg.norm(vectors, axis=1).reshape(-1, 4).max(axis=1)
    return 3.0 * geometry.signed_volumes(mesh.points, mesh.tetrahedra) / area
