"""Spheres of several sizes: masses, contact laws of each pair, conservation, starts, refusals."""

import numpy as np
import pytest

from ca_damper import Batch, InputError, SceneTable, film
from ca_damper.plot.box import Box, DrawnBox
from ca_damper.spheres import Spheres
from ca_damper.spheres.contact_law import hertz_stiffness, pair_numbers, wall_numbers
from tests.ca_spheres.rig import Rig
from tests.slow import slow_but

G, DT, MASS = 9.8, 2e-5, 0.2e-3
MIXED = ((25, 6e-3), (45, 4e-3))
SHAKEN = {"dt": DT, "frequency": 6.0, "amplitude": 0.02}
LAWS = [
    {},
    {"rotation": True},
    {"friction_law": "history", "rotation": True},
    {"search": "all_pairs", "damping": "printed"},
]


def diameters(rig, s=0):
    return rig.device.snapshot(s)["diameter"]


@pytest.mark.parametrize("law", slow_but(LAWS, LAWS[0]))
def test_sizes_that_are_the_same_have_the_bits_of_one(law):
    one = Rig(Spheres(**law), 40, **SHAKEN).run(5000)
    two = Rig(Spheres(sizes=((25, 6e-3), (15, 6e-3)), **law), 40, **SHAKEN).run(5000)
    single = Rig(Spheres(sizes=((40, 6e-3),), **law), 40, **SHAKEN).run(5000)
    for rig in (two, single):
        for found, expected in zip(rig.state(), one.state()):
            assert np.array_equal(found, expected)
        assert rig.energy() == one.energy()
    assert "diameter" not in single.device.snapshot(0)


def test_masses_go_with_the_volume_and_have_the_mean_that_is_asked_for():
    filling = Spheres(sizes=MIXED)
    large, small = filling.masses
    assert large / small == pytest.approx(1.5**3)
    assert 25 * large + 45 * small == pytest.approx(70 * MASS, rel=1e-15)
    assert filling.diameter == 6e-3
    assert filling.radii == (3e-3, 2e-3)


def test_numbers_of_unlike_spheres_are_those_of_hertz():
    """R* = R1 R2 / (R1 + R2), m* = m1 m2 / (m1 + m2), reach R1 + R2."""
    filling = Spheres(sizes=MIXED)
    large, small = filling.masses
    for one, other in ((0, 1), (1, 0)):
        numbers = pair_numbers(filling, one, other)
        expected = hertz_stiffness(6.0 / 5.0 * 1e-3, 0.5e9, 0.3, 0.5e9, 0.3)
        assert numbers["stiffness"] == pytest.approx(expected, rel=1e-14)
        assert numbers["mass"] == pytest.approx(large * small / (large + small), rel=1e-14)
        assert numbers["reach"] == 5e-3
    assert wall_numbers(filling, 1)["mass"] == small


@pytest.mark.parametrize("damping", ["tsuji", "printed"])
def test_unlike_spheres_part_with_their_restitution(damping):
    """At the reference speed, with steps of less than a fiftieth of the contact.

    Momentum is kept to a rounding a step; the smaller first or second, by the order of the sizes.
    """
    speed, steps = 0.5, 4000
    for sizes in (((1, 6e-3), (1, 2e-3)), ((1, 2e-3), (1, 6e-3))):
        gap = 0.5 * (sizes[0][1] + sizes[1][1]) + 1e-5
        places = [(0.02, 0.05), (0.02 + gap, 0.05)]
        start = {"start": places, "start_velocity": [(speed, 0.0), (0.0, 0.0)]}
        filling = Spheres(sizes=sizes, damping=damping, gravity=0.0, restitution=0.5, **start)
        rig = Rig(filling, 2, 2e-7).run(steps)
        after, masses = rig.state()[1][:, 0], np.array(filling.masses)
        assert (after[1] - after[0]) / speed == pytest.approx(0.5, abs=2e-3)
        assert masses @ after == pytest.approx(masses[0] * speed, rel=steps * 1e-15)


@pytest.mark.parametrize("size", [6e-3, 2e-3])
def test_each_size_rebounds_from_the_floor_with_its_restitution(size):
    other = 8e-3 - size
    start = {"start": [(0.03, 0.5 * size + 1e-5), (0.01, 0.05)]}
    velocity = {"start_velocity": [(0.0, -0.5), (0.0, 0.0)]}
    filling = Spheres(sizes=((1, size), (1, other)), gravity=0.0, **start, **velocity)
    after = Rig(filling, 2, 2e-7).run(3000).state()[1]
    assert after[0, 1] / 0.5 == pytest.approx(0.75, abs=2e-3)
    assert np.array_equal(after[1], [0.0, 0.0])


@pytest.mark.parametrize("law", [{}, {"friction_law": "history"}])
def test_oblique_blow_of_unlike_spheres_keeps_angular_momentum(law):
    """Levers add up to the distance: it is kept step by step, to a rounding each."""
    start = {"start": [(0.025, 0.05), (0.0296, 0.0525)]}
    velocity = {"start_velocity": [(0.5, 0.3), (-0.4, -0.1)]}
    sizes = ((1, 6e-3), (1, 4e-3))
    filling = Spheres(sizes=sizes, gravity=0.0, rotation=True, **start, **velocity, **law)
    mass, radius = np.array(filling.masses), np.array(filling.radii)

    def angular_momentum(rig):
        place, moving = rig.state()
        place = place - [0.03, 0.048]
        orbital = mass @ (place[:, 0] * moving[:, 1] - place[:, 1] * moving[:, 0])
        return orbital + 0.4 * mass * radius**2 @ rig.device.snapshot(0)["spin"]

    rig, steps = Rig(filling, 2, DT), 200
    before = angular_momentum(rig.run(1))
    after = angular_momentum(rig.run(steps))
    assert np.abs(rig.device.snapshot(0)["spin"]).min() > 1.0
    assert after == pytest.approx(before, abs=steps * 1e-16 * mass.max() * 0.01)


@pytest.mark.parametrize("law", [{}, {"friction_law": "history"}])
def test_unlike_spheres_that_turn_as_gears_do_not_rub(law):
    """Their surfaces move alike where R1 w1 = -R2 w2: a blow along the line changes no spin."""
    start = {"start": [(0.025, 0.05), (0.0301, 0.05)]}
    velocity = {"start_velocity": [(0.5, 0.0), (0.0, 0.0)]}
    sizes = ((1, 6e-3), (1, 4e-3))
    rig = Rig(Spheres(sizes=sizes, gravity=0.0, rotation=True, **start, **velocity, **law), 2, DT)
    spin = rig.device.rotation.spin
    spin[0], spin[1] = 20.0, -30.0
    after = rig.run(100).state()[1]
    assert after[1, 0] > 0.5
    assert np.abs(after[:, 1]).max() < 1e-14
    assert rig.device.snapshot(0)["spin"] == pytest.approx([20.0, -30.0], rel=1e-12)


@pytest.mark.parametrize("law", LAWS[1:3])
def test_energy_of_a_mixture_falls_until_it_rests(law):
    rig = Rig(Spheres(sizes=MIXED, **law), 70, DT)
    energy = [rig.energy()]
    for _ in range(100):
        energy.append(rig.run(1000).energy())
        assert rig.divergence_code() == 0
    assert np.diff(energy).max() < 0.01 * energy[0]
    assert np.abs(rig.state()[1]).max() < 1e-2


@pytest.mark.slow
def test_a_mixture_carries_its_weight_and_loses_no_momentum():
    """What is left is the momentum kept at the ends, below 2 m/s against the time of 10 s."""
    batch = Batch(Spheres(sizes=MIXED), SceneTable(70, 1, DT, 6.0, 0.6e-3), measured_cycles=60)
    batch.start("rigid")
    force = batch.run(10, 60).mean_force[0]
    assert force == pytest.approx(-70 * MASS * G, abs=70 * MASS * 2.0 / 10.0)
    report = batch.report()
    assert report.momentum_error < 1e-12
    assert report.certificate.audit.misses == 0


@pytest.mark.parametrize("law", LAWS[:3])
def test_both_searches_give_the_same_bits(law):
    cells, pairs = (
        Rig(Spheres(sizes=MIXED, **{**law, "search": search}), 70, **SHAKEN).run(10_000)
        for search in ("cells", "all_pairs")
    )
    for one, other in zip(cells.state(), pairs.state()):
        assert np.array_equal(one, other)


def test_random_starts_mix_the_sizes_and_let_none_overlap():
    """Mean heights of both sizes over seeds differ by 4 sigma at most of those of the sites."""
    rig, heights = Rig(Spheres(sizes=MIXED), 70, DT, seed=np.arange(100)), []
    for s in range(100):
        place, size = rig.state(s)[0], diameters(rig, s)
        assert sorted(size) == [4e-3] * 45 + [6e-3] * 25
        radius = 0.5 * size[:, None]
        gaps = np.linalg.norm(place[:, None] - place[None, :], axis=2) - radius - radius.T
        assert gaps[np.triu_indices(70, 1)].min() > -1e-15
        assert (np.minimum(place, [0.06, 0.096] - place) > radius - 1e-15).all()
        heights.append([place[size == d, 1].mean() for d in (6e-3, 4e-3)])
    apart = np.diff(heights, axis=1)[:, 0]
    assert abs(apart.mean()) < 4.0 * apart.std() / 10.0
    assert not np.array_equal(diameters(rig, 0), diameters(rig, 1))


def test_given_places_take_the_sizes_in_their_order():
    places = [(0.003, 0.003), (0.008, 0.002), (0.012, 0.002)]
    rig = Rig(Spheres(sizes=((1, 6e-3), (2, 4e-3)), start=places), 3, DT)
    assert diameters(rig).tolist() == [6e-3, 4e-3, 4e-3]


def test_numbers_of_sizes_compile_nothing_and_take_turns():
    """Two mixtures on one engine, by turns, have the bits that each has alone."""
    options = [{"sizes": MIXED}, {"sizes": ((5, 5e-3), (20, 3e-3)), "gravity": (3.0, 4.0)}]
    counts, alone = (70, 25), []
    for one, count in zip(options, counts):
        alone.append(Rig(Spheres(**one), count, **SHAKEN).run(2000).state())
    together = [Rig(Spheres(**one), count, **SHAKEN) for one, count in zip(options, counts)]
    assert together[0].engine is together[1].engine
    for _ in range(4):
        for rig in together:
            rig.run(500)
    for rig, expected in zip(together, alone):
        for found, state in zip(rig.state(), expected):
            assert np.array_equal(found, state)


def test_a_picture_shows_the_sizes():
    from matplotlib.figure import Figure

    filling = Spheres(sizes=((2, 6e-3), (3, 4e-3)))
    batch = Batch(filling, SceneTable(5, 1, DT, 6.0, 0.01), mount="base")
    batch.start()
    ((frame, *_),) = film(batch, 10, frame_every=10, progress=None).frames
    drawn = DrawnBox(Figure().add_subplot(), Box.of(filling), 1.0)
    drawn.show(frame)
    assert sorted(drawn.particles.get_widths()) == pytest.approx([4.0] * 3 + [6.0] * 2)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sizes": 6e-3}, "sizes must hold a number and a diameter"),
        ({"sizes": ()}, "for each of 1 to 8 sizes"),
        ({"sizes": ((1, 6e-3),) * 9}, "for each of 1 to 8 sizes"),
        ({"sizes": ((0, 6e-3),)}, "number in sizes must be"),
        ({"sizes": ((1.5, 6e-3),)}, "number in sizes must be"),
        ({"sizes": ((1, -6e-3),)}, "diameter in sizes must be a positive"),
        ({"sizes": ((100, 6e-3), (100, 3e-3))}, "spheres in sizes must be .* 160, got 200"),
        ({"sizes": ((1, 0.2),)}, "width must be at least the diameter 0.2"),
        ({"sizes": ((2, 6e-3),), "start": [(0.03, 0.03)]}, "start must hold 2 places"),
        (
            {"sizes": ((1, 6e-3), (1, 4e-3)), "start": [(0.03, 0.03), (0.0349, 0.03)]},
            "start must not let spheres overlap",
        ),
        (
            {"sizes": ((1, 4e-3), (1, 6e-3)), "start": [(0.002, 0.03), (0.03, 0.002)]},
            "start must keep spheres off the walls, .* for number 1",
        ),
    ],
)
def test_what_cannot_be_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        Spheres(**options)


def test_number_of_particles_must_be_that_of_the_sizes():
    Spheres(sizes=MIXED).check(70, DT)
    with pytest.raises(InputError, match="particles must be 70, as many as in sizes, got 50"):
        Spheres(sizes=MIXED).check(50, DT)
