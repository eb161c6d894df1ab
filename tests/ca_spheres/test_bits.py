"""No bit depends on search, left and right, launches or the batch; effects act when it is said."""

import numpy as np
import pytest

from ca_damper import Batch, SceneTable, Spheres
from tests.ca_spheres.rig import Rig

SHAKEN = {"dt": 2e-5, "frequency": 6.0, "amplitude": 0.02}
TURNING = {"friction_law": "history", "rotation": True}


def final(rig, s=0):
    return np.concatenate([*rig.state(s), [[rig.impulse[s], rig.energy(s)]]])


def test_both_searches_give_the_same_bits():
    # Pairs come in the same order, and those that do not touch add nothing.
    cells, pairs = (
        Rig(Spheres(search=search, **TURNING), [2, 50, 160], **SHAKEN).run(10_000)
        for search in ("cells", "all_pairs")
    )
    for s in range(3):
        assert np.array_equal(final(cells, s), final(pairs, s))
        assert cells.divergence_code(s) == 0


@pytest.mark.parametrize("law", [{}, TURNING])
def test_mirrored_start_runs_mirrored_bit_for_bit(law):
    rig = Rig(Spheres(**law), 50, seed=[3, 3], **SHAKEN)
    rig.mirror(0, to=1)
    (place, mirrored), (velocity, turned) = (array[:, :50] for array in rig.run(10_000).states())
    assert np.array_equal(velocity * [-1.0, 1.0], turned)
    # Places are counted from the left here: the sum of two rounds.
    assert place[:, 0] + mirrored[:, 0] == pytest.approx(0.06, abs=1e-16)
    assert np.array_equal(place[:, 1], mirrored[:, 1])


def test_launches_and_neighbours_in_a_batch_change_no_bit():
    filling = Spheres(**TURNING)
    together = final(Rig(filling, [10, 50, 0, 33], seed=[5, 6, 7, 8], **SHAKEN).run(6000), 1)
    alone = Rig(filling, 50, seed=6, **SHAKEN)
    for steps in (1, 7, 1992, 4000):
        alone.run(steps)
    assert np.array_equal(together, final(alone))


SCENES = 8


def drawn(friction):
    """Scenes of a few spheres at random places of a wide grid that fly about."""
    rng = np.random.default_rng(1)
    counts = rng.integers(1, 5, SCENES)
    filling = Spheres(gravity=0.0, friction=friction, wall_friction=friction)
    rig = Rig(filling, counts, 2e-5)
    for s, count in enumerate(counts):
        sites = rng.permutation(16)[:count]
        places = np.column_stack([sites % 4, sites // 4]) * 0.0145 + (0.004, 0.024)
        speed = rng.uniform(-0.4, 0.4, (count, 2))
        # Along one line, in some: whatever they meet, they meet head on.
        speed[:, 1] *= s % 4 > 0
        rig.put(places, speed, s)
    return rig


def passed(friction, steps):
    """Places and velocities of all spheres before each of some steps, and after it."""
    rig, found = drawn(friction), []
    for step in steps:
        for until in (step, step + 1):
            found.append(np.array(rig.run(until - rig.done).states()))
    return found


def test_friction_is_said_to_begin_in_the_first_step_that_it_changes():
    """Without friction the bits are the same until then, and other ones after it.

    The least coefficient there is computes friction that no place and no speed but 0 can feel.
    """
    first = drawn(0.5).run(4000).device.first_steps(("friction",))["friction"]
    assert np.isinf(first).any() and first.min() < 500 and first[np.isfinite(first)].max() > 1500
    steps = np.unique(np.minimum(first, 3999)).astype(int)
    apart = [np.abs(a - b) for a, b in zip(passed(0.5, steps), passed(1e-60, steps))]
    same = np.max(apart, axis=(1, 3, 4)) < 1e-50
    for step, before, after in zip(steps, same[::2], same[1::2]):
        assert before[first >= step].all()
        assert not after[first == step].any()


def test_auto_has_the_bits_of_what_it_chose():
    def ran(effects, **more):
        table = SceneTable([12] * 2, [1, 2], 2e-5, 6.0, 3e-3)
        filling = Spheres(friction_law="history", **more)
        batch = Batch(filling, table, measured_cycles=1, effects=effects)
        batch.start()
        return batch.run(1, 1).record, batch.filling

    record, filling = ran("auto")
    assert filling.rotation
    assert np.array_equal(record, ran("listed", rotation=True)[0])
