"""What laws of contact are asked: abstract classes, in which geometry and forces are apart.

m: pair of materials, the row of numbers ``self.law[m, 0]`` and on. k: entry of the pair store.
"""

from abc import abstractmethod
from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.kit.display import by_arguments
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.types import real, vec3
from taichi_dem.kit.validation import between, flag, instance, shown
from taichi_dem.laws.base import Effect, Reported
from taichi_dem.materials import Material
from taichi_dem.materials.body_materials import BodyMaterials
from taichi_dem.mesh.mesh import Mesh, volumes
from taichi_dem.state.model import Model
from taichi_dem.state.pair_store import PairStore

#: Overlap up to which limits of a step hold, as a share of the size of a body.
DEEP = 0.05
#: Value of outer_faces for spheres there from the first break on.
ONCE_BROKEN = "once_broken"


@ti.dataclass
class Touch:
    """Two surfaces that touch: overlap [m], rate at which they part [m/s], area of contact.

    The overlap is 0 while they are apart. area: 1 for spheres, [m2] for bodies.
    """

    overlap: real
    rate: real
    area: real


@ti.dataclass
class Push:
    """Answer of a law to a ``Touch``: the spring's repulsion, and what the law has taken for good.

    elastic [N] and spent [J], since the entry was last evaluated; of bodies per area.
    """

    elastic: real
    spent: real


def _outer_faces(value: Any) -> bool | str:
    """The value; InputError unless it is True, False or "once_broken"."""
    if isinstance(value, str) and value != ONCE_BROKEN:
        raise InputError(f"outer_faces must be True, False or {ONCE_BROKEN!r}, got {shown(value)}")
    return value if value == ONCE_BROKEN else flag("outer_faces", value)


class Geometry(Effect):
    """What touches of two bodies, and where; a contact law holds one.

    The methods without a body are what a geometry must give. turn and offset are rotation and place
    [m] of body j in the frame of body i, or those of the second body of an entry (a, b).

    Parameters
    ----------
    outer_faces : bool or str
        True: they touch from the start. ``"once_broken"``: from the first break. False: never.
    skin : float
        Gap up to which an entry is listed, as a share of a body's extent: time, not results.
    """

    role = "geometry"
    is_null = True
    #: Whether entries belong to faces, and a break brings new ones; else to whole bodies.
    by_face = True
    #: Near pairs, contacts and neighbours that a body has room for at the start, in the mean.
    at_start = 0.5, 4.0, 64.0
    #: Equal parts of the edges of a face, at whose inner crossings spheres lie; 3 for one sphere.
    divisions = 3

    def __init__(self, outer_faces: Any, skin: float):
        self.outer_faces, self.skin = _outer_faces(outer_faces), between("skin", skin, 1e-6, 1.0)

    @property
    def face_spheres(self) -> int:
        """Spheres on a face."""
        return (self.divisions - 1) * (self.divisions - 2) // 2

    def declare_columns(self, store: PairStore) -> None:
        """Keep the pair store, which takes the contacts that are found."""
        self.store = store

    @abstractmethod
    def extents(self, model: Model) -> np.ndarray:
        """Radius [m] about the centre of each body within which all lies that can touch, (n,)."""
        raise NotImplementedError

    @abstractmethod
    def find(self, i, j, turn, offset, faces, margin, far):
        """Number of contacts of bodies i, j with a gap below a margin [m]; least gap of all else.

        faces: bit 4 f + g where face f of the one and g of the other are free. The gap is at most
        ``far`` [m]: the search does not ask again before the bodies can have closed it.
        """

    @abstractmethod
    def enter(self, i, j, turn, offset, faces, margin, place):
        """Enter those contacts in the pair store, from a place on."""

    @abstractmethod
    def nearest(self, a, b, turn, offset):
        """Where two bodies are nearest by an entry (a, b) of the pair store, a ``Nearest``."""

    @abstractmethod
    def is_within(self, near, margin):
        """Whether the surfaces of a ``Nearest`` are nearer than a margin [m]."""

    @abstractmethod
    def gap(self, a, b, first, turned_first, second, turned_second):
        """Gap [m] of an entry (a, b), by centre [m] and rotation of both bodies."""

    @abstractmethod
    def meeting(self, near, k, rotation):
        """The ``Meeting`` of entry k; rotation: of the first body."""

    @abstractmethod
    def overlap(self, near):
        """Overlap of two surfaces [m], negative while they are apart."""

    @ti.func
    def depth(self, near, overlap):
        """How deep two surfaces overlap, as a share of their size; overlap: of their meeting."""
        return overlap / near.size

    @ti.func
    def may_meet(self, k, paths, margin):
        """Whether entry k may be within a margin [m], as both bodies have gone ``paths`` [m]."""
        return True

    def forget_paths(self) -> None:
        """Compare all entries anew, wherever bodies have been put."""

    @ti.func
    def settle(self, near, k, paths):
        """Take note of entry k before its forces are evaluated in a step."""

    @ti.func
    def largest_area(self, i, j):
        """Bound of the area of contact of two bodies; 1 for spheres."""
        return 1.0

    @ti.func
    def weight(self, i, j, area):
        """Factor of a dashpot by the masses of two bodies and their area of contact."""
        return 1.0

    def largest_areas(self, mesh: Mesh) -> Any:
        """The bound of the area for each body and its like, (n,) or one number."""
        return 1.0

    def weights(self, mass: np.ndarray, area: Any) -> Any:
        """That factor for each body and its like, (n,) or one number."""
        return 1.0


@ti.data_oriented
class ContactLaw(Effect):
    """Forces of a contact by what its ``geometry`` finds, and what it keeps for each entry.

    The repulsion is that of a spring and a dashpot, at least zero: ``elastic - damping_at * rate``.
    Of bodies all is per area of contact, and the rate counts as often as ``Geometry.weight`` says.
    stiffness_at and damping_at serve kernels and the host alike: they take the numbers of a pair.
    """

    role = "contact"
    reported = Reported(
        "bodies touched", ("sphere_dashpot", "sphere_strain", "hysteresis"), "contact"
    )
    #: Words: option that makes it stiffer, and a value of it; what ends hopping; why no dashpot.
    knob, firmer = "stiffness", "a stiffness of {value:.2g}"
    calmer, undamped = "a dashpot or another restitution", "this contact has none"

    def __init__(self, geometry: Geometry):
        self.geometry = instance("geometry", geometry, Geometry)

    def __repr__(self):
        return by_arguments(self, self.geometry)

    @property
    def has_memory(self) -> bool:
        """Whether it keeps something of each entry, and may take energy of its own."""
        return type(self).keep is not ContactLaw.keep

    @abstractmethod
    def push(self, m, k, touch):
        """The ``Push`` of entry k at a ``Touch``, as its memory stands; nothing changes."""

    @abstractmethod
    def stored(self, m, k, touch):
        """Energy [J] that the spring of entry k gives back; of bodies per area."""

    @abstractmethod
    def stiffness_at(self, numbers, overlap):
        """Largest slope [N/m] of the repulsion up to an overlap [m]: ``ti.pyfunc``."""

    @ti.pyfunc
    def damping_at(self, numbers, overlap):
        """Coefficient of the dashpot [N s/m] at an overlap [m]; friction shares it."""
        return 0.0

    @ti.func
    def keep(self, m, k, touch):
        """Take note of a touch of entry k, once a step; a law that has it has a memory."""

    @ti.func
    def part(self, m, k):
        """Forget entry k, whose surfaces have parted, in a law with a memory."""

    @ti.func
    def row(self, m):
        """Numbers of a pair of materials."""
        return ti.Vector([self.law[m, c] for c in ti.static(range(self._count))])

    def is_damped(self, material: Material) -> bool:
        """Whether contacts of a material have a dashpot."""
        return self.damping_at(self.numbers(material), 0.0) > 0.0

    def firmness(self, mesh: Mesh, materials: BodyMaterials) -> Any:
        """Largest stiffness [N/m] of each body in deep contact, (n,) or one; of bodies per area."""
        return self._in_deep_contact(self.stiffness_at, mesh, materials)

    def strongest(self, mesh: Mesh, materials: BodyMaterials) -> tuple[Any, Any]:
        """Largest stiffness [N/m] and dashpot [N s/m] of a contact of each body with its like."""
        area = self.geometry.largest_areas(mesh)
        weight = self.geometry.weights(materials.density * volumes(mesh), area)
        damping = self._in_deep_contact(self.damping_at, mesh, materials)
        return area * self.firmness(mesh, materials), area * weight * damping

    def _in_deep_contact(self, find, mesh, materials):
        """Largest value of each body, by the numbers of its contacts and a deep overlap."""
        deep = DEEP * np.cbrt(volumes(mesh))
        return materials.largest(lambda material: find(self.numbers(material), deep))


@ti.data_oriented
class FrictionLaw(Effect):
    """Force across a contact, within a limit.

    With ``remembers`` each entry keeps a spring, in the first body's frame; else ``force`` is all.
    """

    role = "friction"
    reported = Reported("bodies rubbed", ("friction",), "friction")
    #: Whether it keeps a spring of each entry.
    remembers = False

    @abstractmethod
    def limit(self, m, force_normal):
        """Largest friction [N] at a normal force [N]; of impulses likewise."""

    @abstractmethod
    def force(self, m, damping, force_normal, slide):
        """Force [N] on the second body against its sliding velocity [m/s], without springs."""

    @ti.func
    def follow(self, k, normal, slip):
        """Turn the spring of entry k into the plane of contact and stretch it by ``slip`` [m]."""

    @ti.func
    def slip(self, m, k, limit, moved):
        """Shorten the spring of entry k to a limit [N]; return the energy dissipated [J]."""
        return 0.0

    @ti.func
    def spring(self, m, k):
        """Force of the spring of entry k on the second body [N]."""
        return vec3(0.0)

    @ti.func
    def stored(self, m, k):
        """Energy of the spring of entry k [J]."""
        return 0.0

    @ti.func
    def part(self, m, k):
        """Forget the spring of entry k, whose surfaces have parted; its energy [J]."""
        return 0.0
