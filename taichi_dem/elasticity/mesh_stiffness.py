"""Young's modulus, Poisson's ratio and wave speeds that a block of a mesh shows, in statics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_dem.elasticity.rates import PAIRS, STRAINS, face_laws, levers, springs_of
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.kit.terminal import aligned
from taichi_dem.kit.validation import instance, shown
from taichi_dem.materials.body_materials import AnyMaterial
from taichi_dem.materials.bond_rules import BondGeometry, evaluated, per_bond
from taichi_dem.mesh.mesh import Mesh, volumes
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import Topology, body_properties, face_vertices, topology_of

#: Residual of a solution, as a share of the largest load, and iterations at most.
_TOLERANCE, _MOST_ITERATIONS = 1e-10, 20_000
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class MeshStiffness:
    """Elastic constants of a block of a mesh.

    Parameters
    ----------
    compliance : ndarray
        Strains per stress [1/Pa], (6, 6), in the order xx, yy, zz, yz, zx, xy; shear as angles.
    density : float
        Density [kg/m^3].
    """

    compliance: np.ndarray
    density: float

    @property
    def stiffness(self) -> np.ndarray:
        """Stresses per strain [Pa], (6, 6): the diagonal holds the moduli of uniaxial strain."""
        return np.linalg.inv(self.compliance)

    @property
    def young_along(self) -> np.ndarray:
        """Stress over strain along x, y and z in a block pulled along it alone [Pa], (3,)."""
        return 1.0 / np.diag(self.compliance)[:3]

    @property
    def poisson_along(self) -> np.ndarray:
        """Mean contraction across over the strain along x, y and z [-], (3,)."""
        across = self.compliance[:3, :3].sum(axis=0) - np.diag(self.compliance)[:3]
        return -0.5 * across * self.young_along

    @property
    def shear_across(self) -> np.ndarray:
        """Shear moduli in the planes yz, zx and xy [Pa], (3,)."""
        return 1.0 / np.diag(self.compliance)[3:]

    @property
    def bulk(self) -> float:
        """Bulk modulus [Pa], the mean of the bounds over all directions (Hill 1952)."""
        return 0.5 * (self.stiffness[:3, :3].sum() / 9.0 + 1.0 / self.compliance[:3, :3].sum())

    @property
    def shear(self) -> float:
        """Shear modulus [Pa], likewise."""
        s, c = self.compliance, self.stiffness
        most = (3.0 * np.trace(c[:3, :3]) - c[:3, :3].sum()) / 30.0 + np.trace(c[3:, 3:]) / 5.0
        least = 7.5 / (3.0 * np.trace(s[:3, :3]) - s[:3, :3].sum() + 1.5 * np.trace(s[3:, 3:]))
        return 0.5 * float(most + least)

    @property
    def young(self) -> float:
        """Young's modulus [Pa], the mean over all directions."""
        return 9.0 * self.bulk * self.shear / (3.0 * self.bulk + self.shear)

    @property
    def poisson(self) -> float:
        """Poisson's ratio [-], the mean over all directions."""
        return 0.5 * self.young / self.shear - 1.0

    @property
    def wave_speeds(self) -> dict[str, float]:
        """Speeds of long waves [m/s]: "pressure" and "shear" in the solid, "bar" in a thin bar."""
        confined = self.bulk + 4.0 / 3.0 * self.shear
        moduli = {"pressure": confined, "shear": self.shear, "bar": self.young}
        return {name: float(np.sqrt(value / self.density)) for name, value in moduli.items()}

    def __str__(self):
        """A line for each axis, the means, and the wave speeds."""
        means = self.young, self.poisson, self.shear, self.bulk + 4.0 / 3.0 * self.shear
        columns = self.young_along, self.poisson_along, self.shear_across, np.diag(self.stiffness)
        rows = {f"along {name}": [column[k] for column in columns] for k, name in enumerate("xyz")}
        cells = [["block of the mesh", "E GPa", "nu", "G GPa", "uniaxial strain GPa"]]
        for name, (young, poisson, *moduli) in {**rows, "all directions": means}.items():
            own = f"{young * 1e-9:.4g}", f"{poisson:.3f}"
            cells.append([name, *own, *(f"{modulus * 1e-9:.4g}" for modulus in moduli)])
        speeds = ", ".join(f"{name} {speed:.4g} m/s" for name, speed in self.wave_speeds.items())
        return "\n".join([*aligned(cells), f"long waves: {speeds}"])

    __repr__ = __str__


def mesh_stiffness(mesh: Mesh, material: AnyMaterial) -> MeshStiffness:
    """Elastic constants of the block that a mesh is, with the bonds of a material, or of several.

    The whole mesh is loaded by six uniform stresses, as tractions on its outer faces, with one
    linear static solve each. The mean strain follows from the displacement of the outer faces,
    which are as compliant as half a bond, as if the solid went on behind them.

    Parameters
    ----------
    mesh : Mesh
        Mesh.
    material : Material
        Material with the stiffness of the bonds.

    Notes
    -----
    This is the most compliant answer in equilibrium: few elements show some per cent less.
    """
    topology = topology_of(instance("mesh", mesh, Mesh))
    if not hasattr(material, "normal_stiffness"):
        raise InputError(f"material must be a Material or BodyMaterials, got {shown(material)}")
    springs = per_bond(mesh, topology, material.density, springs_of(material))
    outer = _OuterFaces(mesh, material)
    # Of 1 Pa, one for each component.
    stresses = (STRAINS != 0.0).astype(float)
    loads = np.stack([outer.wrenches(stress) for stress in stresses], axis=2)
    motions = motions_under(mesh, topology, springs, loads)
    volume, density = volumes(mesh), material.density
    if isinstance(density, np.ndarray):
        density = float((density * volume).sum() / volume.sum())
    strains = [outer.strain(motions[:, :, k], stress) for k, stress in enumerate(stresses)]
    compliance = np.array(strains).T / volume.sum()
    return MeshStiffness(0.5 * (compliance + compliance.T), density)


class _OuterFaces:
    """Outer faces of a mesh, which carry tractions and give way like half a bond."""

    def __init__(self, mesh, material):
        topology = topology_of(mesh)
        self.body, self.count = topology.outer_body, mesh.body_count
        vertices = face_vertices(mesh, self.body, topology.outer_face)
        mass, centre, _ = body_properties(mesh, material.density)
        self.vector = area_vectors(mesh.points, vertices)
        self.area = length(self.vector)
        self.arm = mesh.points[vertices].mean(axis=1) - centre[self.body]
        # A bond to its mirror image: half of it is twice as stiff.
        distance = 2.0 * dot(self.arm, self.vector) / self.area
        halves, both = np.full(len(self.body), 0.5), np.stack([self.body, self.body], axis=1)
        mirrored = BondGeometry(distance, self.area, 0.5 * mass[self.body], halves, both)
        self.springs = 2.0 * evaluated(springs_of(material), mirrored)

    def wrenches(self, stress):
        """Forces and moments of the tractions of a uniform stress on the bodies, (bodies, 6)."""
        force = self.vector @ stress
        total = np.zeros((self.count, 6))
        np.add.at(total, self.body, np.hstack([force, np.cross(self.arm, force)]))
        return total

    def strain(self, motion, stress):
        """Mean strain times the volume at a motion (bodies, 6) under a uniform stress, (6,)."""
        moved = motion[self.body, :3] + np.cross(motion[self.body, 3:], self.arm)
        normal = self.vector / self.area[:, None]
        traction = normal @ stress
        along = dot(traction, normal)[:, None] * normal
        normally, across = self.springs.T[:, :, None]
        moved = moved + along / normally + (traction - along) / across
        mean = self.vector.T @ moved
        mean = mean + mean.T
        return np.array([0.5 * mean[i, i] if i == j else mean[i, j] for i, j in PAIRS])


def motions_under(
    mesh: Mesh, topology: Topology, springs: np.ndarray, forces: np.ndarray
) -> np.ndarray:
    """Motions of rigid bodies joined by linear springs, up to rigid motions of each part."""
    own, rows, neighbour = bond_blocks(mesh, topology, springs)
    solved, rest = np.zeros(forces.shape), forces.copy()
    alone = (own == 0.0).all(axis=(1, 2))
    # Forces on a body without bonds are balanced: what is left of them is rounding.
    rest[alone] = 0.0
    inverse = np.linalg.inv(np.where(alone[:, None, None], np.eye(6), own))
    # Of the largest load: another may be zero but for rounding, as a pull along a face is.
    bound = _TOLERANCE**2 * _products(rest, inverse @ rest).max()
    direction, size = np.zeros(forces.shape), np.ones(forces.shape[2])
    for _ in range(_MOST_ITERATIONS):
        scaled = inverse @ rest
        now = _products(rest, scaled)
        if np.all(now <= bound):
            return solved
        direction = scaled + now / np.maximum(size, _TINY) * direction
        held = own @ direction + rows @ direction[neighbour].reshape(len(direction), 24, -1)
        size, step = now, now / np.maximum(_products(direction, held), _TINY)
        solved += step * direction
        rest -= step * held
    raise InputError(
        f"the springs of a mesh must be solved within {_MOST_ITERATIONS} iterations, and are "
        f"not: bodies may hang on single bonds, or differ too much in size"
    )


def bond_blocks(
    mesh: Mesh, topology: Topology, springs: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Forces on each body by its own motion (bodies, 6, 6) and its neighbours' (bodies, 6, 24)."""
    _, centre, _ = body_properties(mesh, 1.0)
    corners = mesh.points[topology.vertices]
    sides = topology.master, topology.slave
    faces = topology.master_face, topology.slave_face
    maps = [levers(corners - centre[side][:, None]) for side in sides]
    area, law = face_laws(mesh.points, topology.vertices, springs)
    law = (area[:, None, None] / 3.0 * law)[:, None]
    count = mesh.body_count
    neighbour = np.tile(np.arange(count)[:, None], (1, 4))
    own, across = np.zeros((count, 6, 6)), np.zeros((count, 4, 6, 6))
    for here, there in ((0, 1), (1, 0)):
        body, face = sides[here], faces[here]
        neighbour[body, face] = sides[there]
        pulled = maps[here].swapaxes(2, 3) @ law
        across[body, face] = -(pulled @ maps[there]).sum(axis=1)
        np.add.at(own, body, (pulled @ maps[here]).sum(axis=1))
    return own, np.moveaxis(across, 1, 2).reshape(count, 6, 24), neighbour


def _products(first, second):
    """Inner products of two fields, one for each load."""
    return np.einsum("bkl,bkl->l", first, second)
