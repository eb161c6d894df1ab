"""Spheres of several sizes: masses, contact laws of each pair, conservation, starts."""

import numpy as np
import pytest

from ca_damper.spheres import Spheres
from ca_damper.spheres.contact_law import hertz_stiffness, pair_numbers, wall_numbers
from tests.ca_spheres.rig import Rig

DT, MASS = 2e-5, 0.2e-3
MIXED = ((25, 6e-3), (45, 4e-3))
TURNING = {"friction_law": "history", "rotation": True}


def thrown(sizes, places, velocities, dt=DT, **law):
    """One sphere of each size, in their order."""
    rig = Rig(Spheres(sizes=sizes, gravity=0.0, **TURNING, **law), len(sizes), dt)
    for k in range(len(sizes)):
        rig.device.bodies.kind[k] = k
    return rig.put(places, velocities)


def test_sizes_that_are_the_same_have_the_bits_of_one():
    shaken = {"dt": DT, "frequency": 6.0, "amplitude": 0.02}
    one = Rig(Spheres(**TURNING), 40, **shaken).run(5000)
    two = Rig(Spheres(sizes=((25, 6e-3), (15, 6e-3)), **TURNING), 40, **shaken).run(5000)
    assert np.array_equal(two.state(), one.state())
    assert two.energy() == one.energy()


def test_numbers_of_unlike_spheres_are_those_of_hertz():
    """R* = R1 R2 / (R1 + R2), m* = m1 m2 / (m1 + m2), reach R1 + R2; masses as the volumes."""
    filling = Spheres(sizes=MIXED)
    large, small = filling.masses
    assert large / small == pytest.approx(1.5**3)
    assert 25 * large + 45 * small == pytest.approx(70 * MASS, rel=1e-15)
    for one, other in ((0, 1), (1, 0)):
        numbers = pair_numbers(filling, one, other)
        expected = hertz_stiffness(6.0 / 5.0 * 1e-3, 0.5e9, 0.3, 0.5e9, 0.3)
        assert numbers["stiffness"] == pytest.approx(expected, rel=1e-14)
        assert numbers["mass"] == pytest.approx(large * small / (large + small), rel=1e-14)
        assert numbers["reach"] == 5e-3
    assert wall_numbers(filling, 1)["mass"] == small


@pytest.mark.parametrize("sizes", [((1, 6e-3), (1, 2e-3)), ((1, 2e-3), (1, 6e-3))])
def test_unlike_spheres_part_with_their_restitution(sizes):
    """At the reference speed, with steps of less than a fiftieth of the contact.

    Momentum is kept to a rounding a step; the smaller first or second, by the order of the sizes.
    """
    speed, steps, gap = 0.5, 4000, 0.5 * (sizes[0][1] + sizes[1][1]) + 1e-5
    places = [(0.02, 0.05), (0.02 + gap, 0.05)]
    rig = thrown(sizes, places, [(speed, 0.0), (0.0, 0.0)], 2e-7, restitution=0.5).run(steps)
    after, masses = rig.state()[1][:, 0], np.array(rig.filling.masses)
    assert (after[1] - after[0]) / speed == pytest.approx(0.5, abs=2e-3)
    assert masses @ after == pytest.approx(masses[0] * speed, rel=steps * 1e-15)


def test_oblique_blow_of_unlike_spheres_keeps_angular_momentum():
    """Levers add up to the distance: it is kept step by step, to a rounding each."""
    places, velocities = [(0.025, 0.05), (0.0296, 0.0525)], [(0.5, 0.3), (-0.4, -0.1)]
    rig, steps = thrown(((1, 6e-3), (1, 4e-3)), places, velocities), 200
    mass, radius = np.array(rig.filling.masses), np.array(rig.filling.radii)

    def angular_momentum():
        place, moving = rig.state()
        place = place - [0.03, 0.048]
        orbital = mass @ (place[:, 0] * moving[:, 1] - place[:, 1] * moving[:, 0])
        return orbital + 0.4 * mass * radius**2 @ rig.spin()

    rig.run(1)
    before = angular_momentum()
    rig.run(steps)
    assert np.abs(rig.spin()).min() > 1.0
    assert angular_momentum() == pytest.approx(before, abs=steps * 1e-16 * mass.max() * 0.01)
