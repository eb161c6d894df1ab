"""Contact that keeps a part of each overlap (Walton and Braun, J. Rheology 30 (1986) 949)."""

import taichi as ti

from taichi_dem.kit.types import real
from taichi_dem.kit.validation import between, positive
from taichi_dem.laws.body_geometry import BodyGeometry
from taichi_dem.laws.contact_contracts import ContactLaw, Geometry, Push
from taichi_dem.materials import Material
from taichi_dem.materials.bond_rules import typical_of
from taichi_dem.state.pair_store import PairStore


@ti.data_oriented
class WaltonBraun(ContactLaw):
    """A spring that unloads stiffer than it loads: restitution does not depend on speed.

    Loading follows ``stiffness``; unloading and loading again ``stiffness / restitution^2``, from
    the largest overlap so far on, and gives back restitution^2. What touches anew begins anew.

    Parameters
    ----------
    restitution : float, default 0.5
        Speed at which two loose bodies part over that at which they met, from 0.05 to 1 [-].
    stiffness : float, optional
        Stiffness of loading, by default a usual bond's [Pa/m]; of spheres the material's [N/m].
    geometry : Geometry, optional
        What touches: whole bodies (``BodyGeometry()``, the default) or ``SphereGeometry()``.
    """

    calmer, undamped = "a smaller restitution", "this law has none"

    def __init__(
        self,
        restitution: float = 0.5,
        stiffness: float | None = None,
        geometry: Geometry | None = None,
    ):
        self.restitution = between("restitution", restitution, 0.05, 1.0)
        self.stiffness = None if stiffness is None else positive("stiffness", stiffness)
        super().__init__(BodyGeometry() if geometry is None else geometry)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Stiffness of loading and of unloading."""
        usual = material.contact_stiffness, typical_of(material.normal_stiffness)
        stiffness = self.stiffness or float(usual[not self.geometry.by_face])
        return stiffness, stiffness / self.restitution**2

    def declare_columns(self, store: PairStore) -> None:
        """Keep the largest overlap of each entry, times the root of the area: [m2] of bodies."""
        self.largest = store.sphere_column("largest_overlap", real)

    @ti.func
    def push(self, m, k, touch):
        """Along the line of loading up to the largest overlap, below it along that of unloading."""
        loading, unloading, root = self.law[m, 0], self.law[m, 1], ti.sqrt(touch.area)
        before = self.largest[k] / root
        most = ti.max(before, touch.overlap)
        elastic = ti.max(0.0, loading * most - unloading * (most - touch.overlap))
        lost = 0.5 * loading * (1.0 - loading / unloading)
        return Push(elastic=elastic, spent=lost * (most * most - before * before))

    @ti.func
    def stored(self, m, k, touch):
        """What unloading gives back."""
        elastic = self.push(m, k, touch).elastic
        return 0.5 * elastic * elastic / self.law[m, 1]

    @ti.pyfunc
    def stiffness_at(self, numbers, overlap):
        """That of unloading."""
        return numbers[1]

    @ti.func
    def keep(self, m, k, touch):
        """Raise the largest overlap."""
        self.largest[k] = ti.max(self.largest[k], touch.overlap * ti.sqrt(touch.area))

    @ti.func
    def part(self, m, k):
        """What touches anew begins anew."""
        self.largest[k] = 0.0
