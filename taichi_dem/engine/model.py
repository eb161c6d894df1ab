"""What never changes in a run: bodies, bonds and contact spheres as device tables."""

import copy

import numpy as np
import taichi as ti

from taichi_dem.effects.base import ABSENT, MANY, ROLES
from taichi_dem.kit.allocation import defer_fill
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.types import mat3, real, vec4
from taichi_dem.mesh.contact_spheres import spheres_of_faces
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import body_properties, topology_of


@ti.data_oriented
class Model:
    """Constant tables of a scene and the effects bound to them.

    mass [kg] and inertia [kg m^2] with their inverses, radius (of the ball around the body, [m])
    and, with contact, extent (of that around its spheres, [m]) have one entry a body. bond_slots
    names the two faces of a bond as 4 * body + local face, master first; bond_frame has rows
    normal, xi, eta in the master's body frame; bond_stiffness normal and shear [Pa/m].
    vertex_master (face frame) and vertex_slave (body frame) [m] have one entry a contact unit,
    unit_area [m^2] one a bond. neighbour is the body behind local face f, entry 4 * body + f, -1
    where it is outer; face_bond the bond there.
    Body frames coincide with the world axes at the start. Source: Konno et al., section 2.
    """

    constant_fields = (
        *("mass", "mass_inverse", "radius", "extent", "inertia", "inertia_inverse"),
        *("bond_slots", "bond_frame", "bond_stiffness", "unit_area"),
        *("vertex_master", "vertex_slave", "neighbour", "face_bond", "sphere", "cluster"),
    )

    def __init__(self, mesh, material, effects):
        self.mesh = mesh
        self.material = material
        self.topology = topology_of(mesh)
        self.body_count = mesh.body_count
        self.bond_count = self.topology.bond_count
        self.body_mass, self.centre, self.body_inertia = body_properties(mesh, material.density)
        self._allocate_bodies()
        self._allocate_bonds()
        self._bind_effects(effects)

    def __repr__(self):
        bodies, bonds = counted(self.body_count, "body"), counted(self.bond_count, "bond")
        return in_brief(self, bodies, bonds, *(effect.name for effect in self.effects))

    def _bind_effects(self, effects):
        """Sort the effects by role, put null objects where none is listed, and bind them.

        Each is copied first: a bound effect belongs to one model, and a scene may serve many. Its
        kernels would go on to use the fields of the first.
        """
        effects = [copy.copy(effect) for effect in effects]
        by_role = {role: [e for e in effects if e.role == role] for role in ROLES}
        for role, listed in by_role.items():
            if role in MANY:
                setattr(self, f"{role}s", tuple(listed))
            else:
                absent = ABSENT[role]() if role in ABSENT else None
                setattr(self, role, listed[0] if listed else absent)
        self.has_contact = self.contact is not None
        if self.has_contact:
            self._allocate_spheres()
        named = (self.tension.name, self.shear.name, self.dashpot.name)
        self.has_bond_heat = any(named)
        slots = (self.tension, self.shear, self.dashpot, self.friction, self.contact)
        self.effects = tuple(e for e in (*slots, *self.loads, *self.supports) if e is not None)
        for effect in self.effects:
            effect.bind(self)

    def _allocate_bodies(self):
        n = self.body_count
        self.mass = ti.field(real, shape=n)
        self.mass_inverse = ti.field(real, shape=n)
        self.radius = ti.field(real, shape=n)
        self.inertia = ti.Matrix.field(3, 3, real, shape=n)
        self.inertia_inverse = ti.Matrix.field(3, 3, real, shape=n)
        corners = self.mesh.points[self.mesh.tetrahedra] - self.centre[:, None]
        self.body_radius = np.linalg.norm(corners, axis=-1).max(axis=1)
        defer_fill(
            self._load_bodies,
            self.body_mass,
            self.body_radius,
            self.body_inertia,
            np.linalg.inv(self.body_inertia),
        )

    @ti.kernel
    def _load_bodies(
        self,
        mass: ti.types.ndarray(dtype=ti.f64, ndim=1),
        radius: ti.types.ndarray(dtype=ti.f64, ndim=1),
        inertia: ti.types.ndarray(dtype=ti.f64, ndim=3),
        inverse: ti.types.ndarray(dtype=ti.f64, ndim=3),
    ):
        for i in range(self.body_count):
            self.mass[i], self.mass_inverse[i] = mass[i], 1.0 / mass[i]
            self.radius[i] = radius[i]
            for r, c in ti.static(ti.ndrange(3, 3)):
                self.inertia[i][r, c] = inertia[i, r, c]
                self.inertia_inverse[i][r, c] = inverse[i, r, c]

    def _allocate_bonds(self):
        bonds, units = max(1, self.bond_count), max(1, 3 * self.bond_count)
        self.bond_slots = ti.Vector.field(2, ti.i32, shape=bonds)
        self.bond_frame = ti.Matrix.field(3, 3, real, shape=bonds)
        self.bond_stiffness = ti.Vector.field(2, real, shape=bonds)
        self.unit_area = ti.field(real, shape=bonds)
        self.vertex_master = ti.Vector.field(3, real, shape=units)
        self.vertex_slave = ti.Vector.field(3, real, shape=units)
        self.neighbour = ti.field(ti.i32, shape=4 * self.body_count)
        self.face_bond = ti.field(ti.i32, shape=4 * self.body_count)
        defer_fill(self.neighbour.fill, -1)
        defer_fill(self.face_bond.fill, -1)
        if self.bond_count:
            defer_fill(self._load_bonds, *self._bond_tables())

    def _bond_tables(self):
        """Slots, frames, areas and vertices of all bonds as arrays, in the order of the loader."""
        top, points = self.topology, self.mesh.points
        slots = np.stack(
            [4 * top.master + top.master_face, 4 * top.slave + top.slave_face], axis=1
        ).astype(np.int32)
        corners = points[top.vertices]
        area = area_vectors(points, top.vertices)
        size = np.linalg.norm(area, axis=1)
        normal = area / size[:, None]
        xi = corners[:, 1] - corners[:, 0]
        xi /= np.linalg.norm(xi, axis=1, keepdims=True)
        frame = np.stack([normal, xi, np.cross(normal, xi)], axis=1)
        on_master = np.einsum("bij,bqj->bqi", frame, corners - self.centre[top.master][:, None])
        on_slave = corners - self.centre[top.slave][:, None]
        material = self.material
        stiffness = np.tile([material.normal_stiffness, material.shear_stiffness], (len(size), 1))
        return slots, frame, stiffness, size / 3.0, on_master, on_slave

    @ti.kernel
    def _load_bonds(
        self,
        slots: ti.types.ndarray(dtype=ti.i32, ndim=2),
        frame: ti.types.ndarray(dtype=ti.f64, ndim=3),
        stiffness: ti.types.ndarray(dtype=ti.f64, ndim=2),
        area: ti.types.ndarray(dtype=ti.f64, ndim=1),
        on_master: ti.types.ndarray(dtype=ti.f64, ndim=3),
        on_slave: ti.types.ndarray(dtype=ti.f64, ndim=3),
    ):
        for b in range(self.bond_count):
            master, slave = slots[b, 0], slots[b, 1]
            self.bond_slots[b] = [master, slave]
            self.face_bond[master], self.face_bond[slave] = b, b
            self.neighbour[master], self.neighbour[slave] = slave >> 2, master >> 2
            self.bond_stiffness[b] = [stiffness[b, 0], stiffness[b, 1]]
            self.unit_area[b] = area[b]
            m = mat3(0.0)
            for r, c in ti.static(ti.ndrange(3, 3)):
                m[r, c] = frame[b, r, c]
            self.bond_frame[b] = m
            for q in range(3):
                for k in ti.static(range(3)):
                    self.vertex_master[3 * b + q][k] = on_master[b, q, k]
                    self.vertex_slave[3 * b + q][k] = on_slave[b, q, k]

    def _allocate_spheres(self):
        spheres = spheres_of_faces(self.mesh, self.centre, self.contact.divisions)
        self.spheres_per_face = spheres.per_face
        faces = 4 * self.body_count
        self.sphere = ti.Vector.field(4, real, shape=faces * spheres.per_face)
        self.cluster = ti.Vector.field(4, real, shape=faces)
        ball = np.concatenate([spheres.centre, spheres.radius[..., None]], axis=-1)
        defer_fill(self._load_spheres, ball.reshape(-1, 4), spheres.cluster.reshape(-1, 4))
        self.extent = ti.field(real, shape=self.body_count)
        defer_fill(self.extent.from_numpy, spheres.extent)

    @ti.kernel
    def _load_spheres(
        self,
        ball: ti.types.ndarray(dtype=ti.f64, ndim=2),
        cluster: ti.types.ndarray(dtype=ti.f64, ndim=2),
    ):
        for s in range(ball.shape[0]):
            self.sphere[s] = vec4(ball[s, 0], ball[s, 1], ball[s, 2], ball[s, 3])
        for f in range(cluster.shape[0]):
            self.cluster[f] = vec4(cluster[f, 0], cluster[f, 1], cluster[f, 2], cluster[f, 3])
