"""Contact of spheres on broken faces (Konno et al., 2.2, Fig. 5), and friction of contacts."""

from typing import Any

import taichi as ti

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.products import dot, matvec, norm, squared
from taichi_dem.kit.types import real, vec3
from taichi_dem.kit.validation import between, flag, shown, whole
from taichi_dem.laws.base import Effect
from taichi_dem.materials import Material
from taichi_dem.materials.body_materials import BodyMaterials
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import ContactSpheres, spheres_of_faces
from taichi_dem.physics.sphere_pair import Nearest, friction_force, is_within, meeting, normal_force
from taichi_dem.state.model import Model
from taichi_dem.state.pair_store import PairStore

#: Entries of a list for each body: a thousand tetrahedra with as many take some GiB.
_MOST = 100_000
#: Value of outer_faces for spheres there from the first break on.
ONCE_BROKEN = "once_broken"


def _outer_faces(value: Any) -> bool | str:
    """The value; InputError unless it is True, False or "once_broken"."""
    if isinstance(value, str) and value != ONCE_BROKEN:
        raise InputError(f"outer_faces must be True, False or {ONCE_BROKEN!r}, got {shown(value)}")
    return value if value == ONCE_BROKEN else flag("outer_faces", value)


@ti.data_oriented
class SphereContact(Effect):
    """Spheres inscribed behind free faces repel each other (Konno et al., section 2.2).

    Parameters
    ----------
    divisions : int, default 5
        Equal parts of the edges of a face; 5 gives the paper's six spheres a face.
    outer_faces : bool or str, default True
        True: outer faces carry spheres from the start. ``"once_broken"``: from the first break of
        any bond. False: only broken faces carry them, as in the paper, and bodies pass through each
        other elsewhere.
    skin : float, default 0.015
        Gap up to which spheres enter the candidate list, at least, as a share of the radius of a
        body; more where bodies are fast. It changes time, not results.
    neighbours_per_body : int, default 64
        Mean capacity of the list of neighbours.
    pairs_per_body : int, default 24
        Mean capacity of the list of body pairs.
    spheres_per_body : int, default 160
        Mean capacity of the list of sphere contacts, with those of the next search, before those
        that they replace are freed.
    """

    role = "contact"
    name = "sphere_contact"
    activation = "spheres of free faces touch"
    #: Whether bodies meet each other, instead of their spheres.
    meets_bodies = False
    #: What makes it stiffer, how that is written, what calms it, and why it may have no dashpot.
    knob, firmer = "contact_stiffness", "a contact_stiffness of {value:.2g} N/m"
    calmer, undamped = "a larger contact_damping", "contact_damping of the material is 0"

    def __init__(
        self,
        divisions: int = 5,
        outer_faces: bool | str = True,
        skin: float = 0.015,
        neighbours_per_body: int = 64,
        pairs_per_body: int = 24,
        spheres_per_body: int = 160,
    ):
        self.divisions = whole("divisions", divisions, 3, 20)
        self.outer_faces = _outer_faces(outer_faces)
        self.skin = between("skin", skin, 1e-6, 1.0)
        self.neighbours_per_body = whole("neighbours_per_body", neighbours_per_body, 1, _MOST)
        self.pairs_per_body = whole("pairs_per_body", pairs_per_body, 1, _MOST)
        self.spheres_per_body = whole("spheres_per_body", spheres_per_body, 1, _MOST)

    @property
    def face_spheres(self) -> int:
        """Spheres on a face."""
        return (self.divisions - 1) * (self.divisions - 2) // 2

    @property
    def lengths(self) -> tuple:
        """Entries for each body in the lists of pairs, sphere pairs and neighbours."""
        return self.pairs_per_body, self.spheres_per_body, self.neighbours_per_body

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Stiffness [N/m] and damping [N s/m] of a contact."""
        return float(material.contact_stiffness), float(material.contact_damping)

    def spheres(self, model: Model) -> ContactSpheres:
        """Spheres of a model, in balls that hold all of a face, or of a body, that can touch."""
        return spheres_of_faces(model.mesh, model.centre, self.divisions)

    def strongest(self, mesh: Mesh, materials: BodyMaterials) -> tuple[Any, Any]:
        """Largest stiffness [N/m] and dashpot [N s/m] of a contact of each body, (n,) or one."""
        return self.firmness(materials), materials.of_contacts("contact_damping")

    def firmness(self, materials: BodyMaterials) -> Any:
        """Largest value of the constant that ``knob`` names, of each body, (n,) or one."""
        return materials.of_contacts("contact_stiffness")

    def is_damped(self, material: Material) -> bool:
        """Whether contacts of a material, with numbers for its rules, have a dashpot."""
        return float(material.contact_damping) > 0.0

    def declare_columns(self, store: PairStore) -> None:
        """Keep the pair store, which takes the contacts that are found."""
        self.store = store

    @ti.func
    def nearest(self, a, b, turn, offset):
        """Where two bodies are nearest by an entry (a, b) of the pair store, a ``Nearest``."""
        first, second = self.tables.sphere[a], self.tables.sphere[b]
        apart = matvec(turn, second.xyz) + offset - first.xyz
        size = first[3] + second[3]
        return Nearest(first=first, apart=apart, reach=size, size=size)

    @ti.func
    def find(self, i, j, turn, offset, faces, margin, far):
        """Number of contacts of bodies i, j with a gap below a margin [m]; least gap of others."""
        return self._compare(i, j, turn, offset, faces, margin, far, -1)

    @ti.func
    def enter(self, i, j, turn, offset, faces, margin, place):
        """Enter those contacts in the pair store, from a place on."""
        self._compare(i, j, turn, offset, faces, margin, margin, place)

    @ti.func
    def _compare(self, i, j, turn, offset, faces, margin, far, place):
        count, gap = 0, far
        for fg in range(16):
            if (faces >> fg) & 1 == 1:
                first, second = 4 * i + fg // 4, 4 * j + fg % 4
                mine, other = self.tables.cluster[first], self.tables.cluster[second]
                middle, reach = matvec(turn, other.xyz) + offset, other[3] + gap
                if squared(middle - mine.xyz) < (mine[3] + reach) ** 2:
                    size = self.tables.face_spheres[None]
                    for a in range(size * first, size * first + size):
                        sphere = self.tables.sphere[a]
                        # One far from the ball around those of the other face is far from all.
                        if squared(middle - sphere.xyz) < (sphere[3] + reach) ** 2:
                            count, gap = self._compare_one(
                                a, size * second, turn, offset, margin, gap, place, count
                            )
        return count, gap

    @ti.func
    def _compare_one(self, a, first, turn, offset, margin, gap, place, count):
        """The same of sphere a with those of a face, from the first on."""
        sphere = self.tables.sphere[a]
        for b in range(first, first + self.tables.face_spheres[None]):
            other = self.tables.sphere[b]
            reach = sphere[3] + other[3]
            apart = squared(matvec(turn, other.xyz) + offset - sphere.xyz)
            if apart < (reach + margin) ** 2:
                if place >= 0:
                    self.store.sphere[place + count] = [a, b]
                count += 1
            elif apart < (reach + gap) ** 2:
                gap = ti.sqrt(apart) - reach
        return count, gap

    @ti.func
    def is_within(self, near, margin):
        """Whether two bodies are nearer than a margin [m], by a ``Nearest``."""
        return is_within(near, margin)

    @ti.func
    def meeting(self, near, k, rotation):
        """The ``Meeting`` of entry k; rotation: of the first body."""
        return meeting(near.first, near.reach, near.apart, rotation)

    @ti.func
    def settle(self, near, k):
        """Prepare entry k before its forces are evaluated."""

    @ti.func
    def normal(self, m, overlap, opening_rate):
        """Repulsion [N] at an overlap [m] of spheres that part at opening_rate [m/s]."""
        return normal_force(self.law[m, 0], self.law[m, 1], overlap, opening_rate)

    @ti.func
    def elastic(self, m, overlap):
        """Spring's part of the repulsion [N]."""
        return self.law[m, 0] * overlap

    @ti.func
    def damping(self, m):
        """Damping coefficient of a contact [N s/m]; friction shares it."""
        return self.law[m, 1]

    @ti.func
    def weight(self, a, b, area):
        """Factor of the rate at which entry (a, b) parts, in its dashpot."""
        return 1.0

    @ti.func
    def stored(self, m, overlap):
        """Elastic energy of a contact [J]."""
        return 0.5 * self.law[m, 0] * overlap * overlap


@ti.data_oriented
class Friction(Effect):
    """Sliding friction of contacts, without a tangential spring (Konno et al., section 2.2)."""

    role = "friction"
    activation = "bodies that touch slide"
    may_be_silent = True

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Friction coefficient."""
        return (material.friction,)

    @ti.func
    def limit(self, m, force_normal):
        """Largest friction [N] at a normal force [N]; of impulses likewise."""
        return self.law[m, 0] * force_normal

    @ti.func
    def force(self, m, damping, force_normal, slide):
        """Force [N] on the second sphere against its sliding velocity [m/s]."""
        return friction_force(self.law[m, 0], damping, force_normal, slide)


@ti.data_oriented
class StickingFriction(Friction):
    """Friction with a spring in each contact, up to a limit (Cundall and Strack 1979).

    A body at rest on a slope below the friction angle stays there; with ``Friction`` it creeps. The
    stretch of a spring turns with the first body and is lost when the two part. Between bodies
    (``BodyContact``) the spring always has the area of the smaller body's largest face: with the
    area of contact it would creep.

    Parameters
    ----------
    stiffness_ratio : float, default 0.8
        Ratio of the stiffness of the spring to that along the normal, from 1e-6 to 1; spheres of
        a Poisson's ratio nu have 2 (1 - nu) / (2 - nu) (Mindlin 1949).
    """

    name = "sticking_friction"
    activation = "bodies that touch slide"
    remembers = True
    #: Its springs let bodies that touch remember: without a limit they would still slip.
    may_be_silent = False

    def __init__(self, stiffness_ratio: float = 0.8):
        self.stiffness_ratio = between("stiffness_ratio", stiffness_ratio, 1e-6, 1.0)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Friction coefficient, stiffness of the spring of spheres [N/m], and its ratio."""
        spring = self.stiffness_ratio * float(material.contact_stiffness)
        return material.friction, spring, self.stiffness_ratio

    def declare_columns(self, store: PairStore) -> None:
        """Keep the stretch [m] of the spring of each sphere pair, in the first body's frame."""
        self.stretch = store.sphere_column("tangential_stretch", real, 3)
        if self.tables.contact.meets_bodies:
            self.bodies = store.sphere

    @ti.func
    def stiffness(self, m, k):
        """Stiffness of the spring of pair k [N/m]; of bodies for as much area as may touch."""
        found = self.law[m, 1]
        if ti.static(self.tables.contact.meets_bodies):
            area = self.tables.contact.largest_area(self.bodies[k][0], self.bodies[k][1])
            found = self.law[m, 2] * self.tables.contact.elastic(m, 1.0) * area
        return found

    @ti.func
    def follow(self, k, normal, way):
        """Turn the spring of sphere pair k into the contact's plane, stretch it by ``way`` [m]."""
        stretch = self.stretch[k]
        flat = stretch - dot(stretch, normal) * normal
        # Turned, not projected: to turn with the contact takes no energy.
        self.stretch[k] = flat * (norm(stretch) / ti.max(norm(flat), 1e-300)) + way

    @ti.func
    def slip(self, m, k, limit, way):
        """Shorten the spring of sphere pair k to a limit [N]; return the energy dissipated [J]."""
        # Work of the stretch at the mean force = energy stored + energy dissipated by slipping.
        trial = self.stretch[k]
        stiffness = self.stiffness(m, k)
        longest = limit / stiffness
        size = norm(trial)
        present = trial
        if size > longest:
            present = trial * (longest / size)
        self.stretch[k] = present
        return 0.5 * stiffness * dot(trial - way + present, trial - present)

    @ti.func
    def spring(self, m, k):
        """Force of the spring of sphere pair k on the second sphere [N]."""
        return -self.stiffness(m, k) * self.stretch[k]

    @ti.func
    def stored(self, m, k):
        """Elastic energy in the spring of sphere pair k [J]."""
        return 0.5 * self.stiffness(m, k) * squared(self.stretch[k])

    @ti.func
    def part(self, m, k):
        """Reset the spring of sphere pair k, whose spheres have parted; return its energy [J]."""
        energy = self.stored(m, k)
        self.stretch[k] = vec3(0.0)
        return energy
