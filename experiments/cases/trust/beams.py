"""Beams on two lines that are pressed in the middle, in statics: how they bend, and with a notch.

Bodies bear couples, so that beams of few elements are stiffer, as 1 + c (h / H)^2 for elements h.
"""

from functools import partial

import numpy as np

from cases.trust import Number
from taichi_dem import Material, shapes
from taichi_dem.elasticity.mesh_stiffness import bond_blocks
from taichi_dem.elasticity.rates import springs_of
from taichi_dem.materials.bond_rules import per_bond
from taichi_dem.mesh.topology import body_properties, faces_of_group, topology_of

#: Span over the height, of a whole beam and of a notched one; elements in the height.
LONG, SHORT, FEW, MANY, FINE = 8.0, 4.0, 4, 8, 12
POISSON = 0.2
ROCK = {
    **{"young": 30e9, "poisson": POISSON, "density": 2400.0, "tensile_strength": 4e6},
    **{"fracture_energy": 100.0, "friction_angle": 30.0, "cohesion": 12e6},
}
TIMOSHENKO = "beam theory with shear, Timoshenko"
SRAWLEY = "linear fracture mechanics, Srawley, Int. J. Fract. 12 (1976) 475"


def beams(effort):
    """Deflection of a whole beam, by elements of two sizes, and stress intensity at a notch."""
    seeds = effort.seeds
    few, many = (np.array([Beam(n, LONG, k).rigidity() for k in seeds]) for n in (FEW, MANY))
    factor = np.array([Beam(FINE, SHORT, seed).intensity(0.5) for seed in seeds])
    whole = many + (many - few) / ((MANY / FEW) ** 2 - 1.0)
    row = partial(Number, source=TIMOSHENKO, allowed=0.02)
    coarse = "bodies bear couples, the less the smaller they are"
    words = "deflection of a beam, {} elements in its height"
    notch = f"stress intensity at a notch of half the height, {FINE} elements in that"
    return [
        row("beam_bends", words.format(MANY), 1.0, 1.0 / many, miss=coarse),
        row(
            "beam_bends_on", f"{words.format(f'{FEW} and {MANY}')}, extrapolated", 1.0, 1.0 / whole
        ),
        Number("beam_notch", notch, 1.0, factor, source=SRAWLEY, allowed=0.1),
    ], {}


class Beam:
    """A beam of height 1 and its bonds; a force of 1 in the middle, and one along its axis."""

    def __init__(self, elements, span, seed):
        self.span, self.edge, self.length = span, 1.0 / elements, span + 1.0
        size = {"length": self.length, "height": 1.0, "width": self.edge, "element": self.edge}
        self.mesh = shapes.beam(**size, scatter=seed)
        self.top, rock = topology_of(self.mesh), Material.from_elastic(**ROCK)
        self.springs = per_bond(self.mesh, self.top, rock.density, springs_of(rock))
        self.centre = body_properties(self.mesh, 1.0)[1]
        self.forces = np.stack([self._bend(), self._pull()], axis=2)

    def _near(self, group, x):
        """Share of each body in a force on a group near x."""
        near = np.zeros(len(self.centre))
        near[faces_of_group(self.mesh, self.top, group)[0]] = 1.0
        near[np.abs(self.centre[:, 0] - x) > 1.01 * self.edge] = 0.0
        return near / near.sum()

    def _bend(self):
        """Forces on three lines: bodies (n, 6)."""
        total, middle = np.zeros((len(self.centre), 6)), 0.5 * self.length
        ends = ("bottom", 0.5, 0.5), ("bottom", self.length - 0.5, 0.5)
        for group, x, force in (("top", middle, -1.0), *ends):
            share = force * self._near(group, x)
            total[:, 1] += share
            total[:, 5] += share * (x - self.centre[:, 0])
        return total

    def _pull(self):
        total = np.zeros((len(self.centre), 6))
        total[:, 0] = self._near("right", self.length) - self._near("left", 0.0)
        return total

    def moved(self, springs):
        """Motions of the bodies (n, 6, 2), the first of them at rest."""
        from scipy.sparse import bsr_matrix
        from scipy.sparse.linalg import splu

        own, others, neighbour = bond_blocks(self.mesh, self.top, springs)
        count = len(own)
        blocks = np.concatenate([own[:, None], others.reshape(count, 6, 4, 6).swapaxes(1, 2)], 1)
        columns = np.column_stack([np.arange(count), neighbour]).ravel()
        given = blocks.reshape(-1, 6, 6), columns, 5 * np.arange(count + 1)
        matrix = bsr_matrix(given, shape=(6 * count, 6 * count)).tocsc()[6:, 6:]
        solver = splu(matrix, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
        found = np.zeros((6 * count, 2))
        found[6:] = solver.solve(self.forces.reshape(6 * count, 2)[6:])
        return found.reshape(count, 6, 2)

    def young(self, motions):
        """Young's modulus along the beam, as it shows when it is pulled."""
        x = self.centre[:, 0]
        inner = np.abs(x - 0.5 * self.length) < 0.5 * self.span - 0.5
        return 1.0 / (np.polyfit(x[inner], motions[inner, 0, 1], 1)[0] * self.edge)

    def rigidity(self):
        """Deflection by theory over that of the axis against the places over the supports."""
        motions, (x, y, _) = self.moved(self.springs), self.centre.T
        young, k = self.young(motions), 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON)

        def axis(at):
            near = (np.abs(x - at) < 1.5 * self.edge) & (np.abs(y - 0.5) < 0.75 * self.edge)
            return (motions[near, 1, 0] + motions[near, 5, 0] * (at - x[near])).mean()

        found = 0.5 * (axis(0.5) + axis(self.length - 0.5)) - axis(0.5 * self.length)
        bent = self.span**3 / 4.0 + self.span * (1.0 + POISSON) / (2.0 * k)
        return float(bent / (young * self.edge) / found)

    def intensity(self, depth):
        """Stress intensity over the formula's, by the compliance that a notch of a depth adds."""
        first, second = self.top.master, self.top.slave
        ahead = self.centre[:, 0] > 0.5 * self.length
        corners = self.mesh.points[self.top.vertices]
        cut = (ahead[first] != ahead[second]) & (corners.mean(axis=1)[:, 1] < depth)
        edges = np.diff(corners[cut], axis=1)
        area = 0.5 * np.abs(np.cross(edges[:, 0], edges[:, 1])[:, 0]).sum()
        whole, open_ = (self.moved(s) for s in (self.springs, self.springs * ~cut[:, None]))
        added = float((self.forces[..., 0] * (open_ - whole)[..., 0]).sum())
        a = np.linspace(0.0, area / self.edge, 1001)
        shape = 1.99 - a * (1.0 - a) * (2.15 - 3.93 * a + 2.7 * a * a)
        shape = 1.5 * np.sqrt(a) * shape / ((1.0 + 2.0 * a) * (1.0 - a) ** 1.5)
        expected = 2.0 * self.span**2 * np.trapezoid(shape**2, a)
        return float(np.sqrt(added * self.young(whole) * self.edge / expected))
