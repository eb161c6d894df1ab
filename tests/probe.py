"""One bond or one contact pair moved by hand: forces as a step computes them."""

import numpy as np
import taichi as ti

from taichi_dem import CONCRETE, Multirate, Scene, Simulation
from taichi_dem.kit.allocation import assign, values

#: Step by which the probes divide impulses; a power of two loses no bit.
STEP = 2.0**-20


class Probe:
    """A scene of two bodies that are placed by hand."""

    def __init__(self, mesh, effects, material=CONCRETE):
        self.simulation = Simulation(Scene(mesh, material, effects), Multirate(STEP, 1.0))
        self.model, self.state = self.simulation.model, self.simulation.state
        self.step, self.tables = self.simulation.step, self.simulation.tables
        self.centre = self.model.centre

    def place(self, position, orientation=None, velocity=None, spin=None):
        """Place both bodies, arrays (2, ...)."""
        still = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
        turned = still if orientation is None else orientation
        self.state.set_motion(position, turned, velocity, spin)


@ti.data_oriented
class BondProbe(Probe):
    """A bonded pair whose motion is prescribed; every call evaluates its bond once.

    mesh: two bodies that share a face. Displacements [m], rotations and velocities are those of
    the slave, the master rests, unless ``move`` is given both.
    """

    def __init__(self, mesh, effects, material=CONCRETE):
        super().__init__(mesh, effects, material)
        corners = mesh.points[self.model.topology.vertices[0]]
        self.area = 0.5 * np.linalg.norm(np.cross(*(corners[1:] - corners[0])))
        self.frame = values(self.tables.bond_frame, 0)
        self._slots = values(self.tables.bond_slots, 0)
        fields = self.state.fields()
        ends = "_unit", "_slip", "broken_tick", "exposed_tick", "bond_drag", "bond_heat"
        self._changing = [(f, values(f)) for name, f in fields.items() if name.endswith(ends)]

    def reset(self):
        """Undo all history of the bond."""
        for field, first in self._changing:
            assign(field, first)
        self.state.tick[None] = 0

    def move(self, position, orientation=None, velocity=None, spin=None):
        """Place both bodies, arrays (2, ...), and evaluate the bond; see ``evaluate``."""
        self.place(position, orientation, velocity, spin)
        return self.evaluate()

    def open(self, opening, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)):
        """Displace the slave by an opening in the face frame [m] and evaluate.

        velocity [m/s] and spin [rad/s] of the slave are in the face frame too. Returns the force
        on the master per area in the face frame [Pa].
        """
        position = self.centre + np.outer([0.0, 1.0], self.frame.T @ opening)
        motion = [np.outer([0.0, 1.0], self.frame.T @ np.asarray(v)) for v in (velocity, spin)]
        wrench = self.move(position, None, *motion)
        return self.frame @ wrench[0, :3] / self.area

    def evaluate(self):
        """Force [N] and torque about the own centre [N m] on master and slave, (2, 6)."""
        wrench = np.zeros((2, 6))
        self._evaluate(wrench)
        return wrench / STEP

    def stored(self):
        """Elastic energy of the bond [J]."""
        return float(self.simulation.readings.bonds()[0, 0])

    def spent(self):
        """Energy per area that softening has spent in the three units [J/m^2]."""
        spent = np.zeros(3)
        self._spent(spent)
        return spent

    @property
    def heat(self):
        """Energy taken by dashpots, slip and release [J]."""
        drag = getattr(self.state, "bond_drag", None)
        taken = 0.0 if drag is None else values(drag, 0)
        return np.array([taken, *values(self.state.bond_heat, 0)])

    @property
    def broken(self):
        """Whether the face is released."""
        return values(self.state.broken_tick, 0) >= 0

    @ti.kernel
    def _evaluate(self, wrench: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        for _ in range(1):
            slots = self.tables.bond_slots[0]
            for side in ti.static(range(2)):
                self.state.slot[slots[side]] = 0.0 * self.state.slot[slots[side]]
            self.step.bond(0)
            for side in ti.static(range(2)):
                for k in ti.static(range(6)):
                    wrench[side, k] = self.state.slot[slots[side]][k]

    @ti.kernel
    def _spent(self, spent: ti.types.ndarray(dtype=ti.f64, ndim=1)):
        for q in range(3):
            m, stiffness = self.tables.bond_pair[0], self.tables.bond_stiffness[0]
            spent[q] = self.tables.bond.spent(m, q, stiffness)


@ti.data_oriented
class ContactProbe(Probe):
    """Two loose bodies with spheres on every face; one chosen sphere pair is evaluated.

    mesh: two bodies without a common face.
    """

    def __init__(self, mesh, effects, material=CONCRETE):
        super().__init__(mesh, effects, material)
        self.store = self.simulation.contacts.store
        self.sphere = self.simulation.values(self.tables.geometry.sphere)

    def evaluate(self, spheres, position, orientation=None, velocity=None, spin=None):
        """Force [N] and torque [N m] on both bodies (2, 6), and the three heats per STEP [W].

        spheres: sphere numbers on body 0 and body 1.
        """
        self.place(position, orientation, velocity, spin)
        wrench, heat = np.zeros((2, 6)), np.zeros(3)
        self._evaluate(spheres[0], spheres[1], wrench, heat)
        return wrench / STEP, heat / STEP

    @ti.kernel
    def _evaluate(
        self,
        a: ti.i32,
        b: ti.i32,
        wrench: ti.types.ndarray(dtype=ti.f64, ndim=2),
        heat: ti.types.ndarray(dtype=ti.f64, ndim=1),
    ):
        for _ in range(1):
            self.store.clear_slot(0)
            self.store.body[0] = [0, 1]
            self.store.sphere[0] = [a, b]
            self.store.first[0], self.store.last[0] = 0, 1
            self.step.contact(0)
            for side in ti.static(range(2)):
                for k in ti.static(range(6)):
                    wrench[side, k] = self.store.impulse[side][k]
            for k in ti.static(range(3)):
                heat[k] = self.store.heat[0][k]
