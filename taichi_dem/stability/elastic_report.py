"""What a scene's mesh makes of its material, before a run: elastic constants, cracks, steps."""

import contextlib
from dataclasses import dataclass

import numpy as np

from taichi_dem.elasticity.mesh_stiffness import MeshStiffness, mesh_stiffness
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import instance
from taichi_dem.materials import Material
from taichi_dem.materials.bond_rules import ModulusOverDistance
from taichi_dem.materials.moduli import elastic_constants
from taichi_dem.mesh.mesh import Mesh, volumes
from taichi_dem.scene import Scene
from taichi_dem.stability.step_report import StepReport, step_report

#: Elements in a characteristic length below which cracks are those of the mesh.
ELEMENTS = 4.0


@dataclass(frozen=True, eq=False)
class ElasticReport:
    """Elastic constants of a scene's mesh beside those asked for, and what follows from them.

    Parameters
    ----------
    stiffness : MeshStiffness
        Elastic constants of the block that the mesh is.
    asked : tuple of (float, float) or None
        Young's modulus [Pa] and Poisson's ratio for which the material was made; None for a
        material of constants per area, and for several materials.
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
        """A sentence where elements are too large for cracks; those of ``steps`` are its own."""
        coarse = int((self.elements < ELEMENTS).sum())
        words = (
            f"the characteristic length E G_f / tensile_strength^2 = {self._crack_words()} m is "
            f"less than {ELEMENTS:g} elements at {coarse} of {len(self.element_size)} bodies, with "
            f"edges of up to {self.element_size.max():.3g} m: strength and paths of cracks there "
            "are the mesh's"
        )
        return (words,) if coarse else ()

    def _crack_words(self):
        """The characteristic length, or the range of several, as a number for a sentence."""
        ends = np.unique([np.min(self.crack_length), np.max(self.crack_length)])
        return " to ".join(f"{length:.3g}" for length in ends)

    def __repr__(self):
        stiffness = f"E {self.stiffness.young:.4g} Pa, nu {self.stiffness.poisson:.3g}"
        return in_brief(self, stiffness, *self.warnings, "print it for the table")

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


def elastic_report(scene: Scene) -> ElasticReport:
    """Elastic constants that the mesh of a scene shows with its material; print it before a run.

    Parameters
    ----------
    scene : Scene
        Scene to judge.

    Returns
    -------
    ElasticReport
        Print it for the table.

    Raises
    ------
    InputError
        The argument is no Scene, or the springs cannot be solved.

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
    lengths = [own.young * one.fracture_energy / one.tensile_strength**2 for own, one in pairs]
    return ElasticReport(stiffness, asked, np.array(lengths)[laid.of_body], sizes, steps)


def element_sizes(mesh: Mesh) -> np.ndarray:
    """Edge of the regular tetrahedron of the volume of each body [m], (body_count,)."""
    return np.cbrt(6.0 * np.sqrt(2.0) * volumes(mesh))


def _asked(material: Material) -> tuple[float, float] | None:
    """E [Pa] and Poisson's ratio for which a material was made, None where it names none."""
    normal, shear = material.normal_stiffness, material.shear_stiffness
    if isinstance(normal, ModulusOverDistance) and isinstance(shear, ModulusOverDistance):
        with contextlib.suppress(InputError):
            return elastic_constants(normal.modulus, shear.modulus)
    return None
