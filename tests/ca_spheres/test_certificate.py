"""What a run of spheres certifies is true: onsets of effects, what was left out."""

import numpy as np

from ca_damper import Batch, SceneTable, Spheres
from tests.ca_spheres.rig import Rig

DT = 2e-5
SCENES = 8


def drawn(friction):
    """Scenes of a few spheres at random places of a wide grid that fly about."""
    rng = np.random.default_rng(1)
    counts = rng.integers(1, 5, SCENES)
    filling = Spheres(gravity=0.0, friction=friction, wall_friction=friction)
    rig = Rig(filling, counts, DT)
    for s, count in enumerate(counts):
        sites = rng.permutation(16)[:count]
        places = np.column_stack([sites % 4, sites // 4]) * 0.0145 + (0.004, 0.024)
        speed = rng.uniform(-0.4, 0.4, (count, 2))
        # Along one line, in some: whatever they meet, they meet head on.
        speed[:, 1] *= s % 4 > 0
        rig.put(places, speed, s)
    return rig


def test_friction_is_said_to_begin_in_the_first_step_that_it_changes():
    """Without friction the bits are the same until then, and other ones after it.

    The least coefficient there is computes friction that no place and no speed but 0 can feel.
    """

    def same():
        apart = [np.abs(a - b).max(axis=(1, 2)) for a, b in zip(rubbing.states(), smooth.states())]
        return np.max(apart, axis=0) < 1e-50

    first = drawn(0.5).run(4000).device.first_steps(("friction",))["friction"]
    assert np.isinf(first).any() and first.min() < 500 and first[np.isfinite(first)].max() > 1500
    rubbing, smooth = drawn(0.5), drawn(1e-60)
    for step in np.unique(np.minimum(first, 3999)).astype(int):
        for rig in (rubbing, smooth):
            rig.run(step - rig.done)
        assert same()[first >= step].all()
        for rig in (rubbing, smooth):
            rig.run(1)
        assert not same()[first == step].any()


def test_auto_has_the_bits_of_what_it_chose():
    def ran(effects, **more):
        table = SceneTable([12] * 2, [1, 2], DT, 6.0, 3e-3)
        filling = Spheres(friction_law="history", **more)
        batch = Batch(filling, table, measured_cycles=1, effects=effects)
        batch.start()
        return batch.run(1, 1).record, batch.filling

    record, filling = ran("auto")
    assert filling.rotation
    assert np.array_equal(record, ran("listed", rotation=True)[0])
