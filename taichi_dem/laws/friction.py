"""Friction of contacts, with and without a tangential spring."""

import taichi as ti

from taichi_dem.kit.products import dot, norm, squared
from taichi_dem.kit.types import real, vec3
from taichi_dem.kit.validation import between
from taichi_dem.laws.contact_contracts import FrictionLaw
from taichi_dem.materials import Material
from taichi_dem.physics.sphere_pair import friction_force
from taichi_dem.state.pair_store import PairStore


@ti.data_oriented
class NoFriction(FrictionLaw):
    """Frictionless contacts."""

    is_null = True

    @ti.func
    def limit(self, m, force_normal):
        """No friction at any normal force."""
        return 0.0

    @ti.func
    def force(self, m, damping, force_normal, slide):
        """No force at any sliding velocity."""
        return vec3(0.0)


@ti.data_oriented
class Friction(FrictionLaw):
    """Sliding friction of contacts, without a tangential spring (Konno et al., section 2.2)."""

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
    (``BodyContact``) the spring always has the area of the smaller body's largest face.

    Parameters
    ----------
    stiffness_ratio : float, default 0.8
        Ratio of the stiffness of the spring to that along the normal, from 1e-6 to 1; spheres of
        a Poisson's ratio nu have 2 (1 - nu) / (2 - nu) (Mindlin 1949).
    """

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
        self.entry = store.sphere

    @ti.func
    def stiffness(self, m, k):
        """Stiffness of the spring of pair k [N/m]; of bodies for as much area as may touch."""
        stiffness, contact, entry = self.law[m, 1], self.tables.contact, self.entry[k]
        if ti.static(not self.tables.geometry.by_face):
            area = self.tables.geometry.largest_area(entry[0], entry[1])
            stiffness = self.law[m, 2] * contact.stiffness_at(contact.row(m), 0.0) * area
        return stiffness

    @ti.func
    def follow(self, k, normal, slip):
        """Turn the spring of sphere pair k into the contact's plane, stretch it by ``slip`` [m]."""
        stretch = self.stretch[k]
        flat = stretch - dot(stretch, normal) * normal
        # Turned, not projected: to turn with the contact takes no energy.
        self.stretch[k] = flat * (norm(stretch) / ti.max(norm(flat), 1e-300)) + slip

    @ti.func
    def slip(self, m, k, limit, moved):
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
        return 0.5 * stiffness * dot(trial - moved + present, trial - present)

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
