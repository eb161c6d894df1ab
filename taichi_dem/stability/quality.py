"""Quality of the elements of a mesh, and the cost of bad ones in time step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.terminal import aligned
from taichi_dem.kit.validation import instance
from taichi_dem.materials import Material
from taichi_dem.materials.body_materials import AnyMaterial, BodyMaterials
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import body_properties, topology_of
from taichi_dem.stability.step_report import StepReport, bond_steps


@dataclass(frozen=True, eq=False, repr=False)
class QualityReport(StepReport):
    """Quality of each body, arrays (body_count,), and the explicit steps that its bonds allow.

    Parameters
    ----------
    limits : dict
        Largest explicit steps [s] by criterion, bond_stiffness and bond_dashpot, at which a pair of
        two such bodies is stable, shape (body_count,), as all arrays.
    warnings : tuple of str
        None.
    volume_m3 : ndarray
        Volumes [m^3].
    mass_kg : ndarray
        Masses [kg].
    aspect_ratio : ndarray
        Longest edge over smallest altitude [-]; 1.22 for a regular tetrahedron.
    smallest_altitude_m : ndarray
        Smallest altitudes [m].
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
    point_count: int
    bond_count: int
    outer_count: int

    @property
    def dashpot_step_s(self) -> np.ndarray:
        """Largest explicit step at which a body is stable with its bond dashpots [s]."""
        return self.limits["bond_dashpot"]

    @property
    def spring_step_s(self) -> np.ndarray:
        """The same with its bond springs [s]."""
        return self.limits["bond_stiffness"]

    def __str__(self) -> str:
        """Counts, ranges and the worst bodies as a table."""
        ranges = {
            "smallest altitude m": self.smallest_altitude_m,
            "mass kg": self.mass_kg,
            "aspect ratio": self.aspect_ratio,
            "bond dashpot step s": self.dashpot_step_s,
            "bond spring step s": self.spring_step_s,
        }
        rows = [["", "smallest", "median", "largest"]]
        for name, values in ranges.items():
            figures = values.min(), np.median(values), values.max()
            rows.append([name, *(f"{figure:.3g}" for figure in figures)])
        worst = [["worst body", "altitude m", "aspect", "spring s", "dashpot s", "price"]]
        columns = self.smallest_altitude_m, self.aspect_ratio, *self.limits.values()
        for body, price in zip(self.worst(), self.price()):
            worst.append([f"{body}", *(f"{each[body]:.3g}" for each in columns), f"{price:.3f}"])
        counts = (
            f"{len(self.mass_kg)} bodies, {self.point_count} points, {self.bond_count} bonds, "
            f"{self.outer_count} outer faces, volume {self.volume_m3.sum():.6g} m3"
        )
        words = "price: how much larger the step of all would be without this body and those above"
        return "\n".join([counts, *aligned(rows), "", *aligned(worst), words])


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
    vectors = geometry.area_vectors(mesh.points, geometry.all_faces(mesh.tetrahedra))
    volume = geometry.signed_volumes(mesh.points, mesh.tetrahedra)
    altitude = 3.0 * volume / np.linalg.norm(vectors, axis=1).reshape(-1, 4).max(axis=1)
    longest = geometry.edge_lengths(mesh.points, mesh.tetrahedra).max(axis=1)
    return QualityReport(
        limits=bond_steps(mesh, material),
        warnings=(),
        volume_m3=volume,
        mass_kg=mass,
        aspect_ratio=longest / altitude,
        smallest_altitude_m=altitude,
        point_count=mesh.point_count,
        bond_count=topology.bond_count,
        outer_count=topology.outer_count,
    )
