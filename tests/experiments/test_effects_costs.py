"""Costs of effects from the same states: states put into the damper, tables, known lists."""

import numpy as np
import pytest

from ca_damper.lattice import DIRECTIONS, HELD
from taichi_dem import ImplicitDashpots, simulate
from taichi_dem.kit.errors import InputError

TABLE = {"particles": 30, "ratios": (0.96, 1.0), "seeds": (1, 2), "measured_cycles": 2}
STEPS = {"spheres": 2e-5, "automaton": 1e-4}


@pytest.fixture(scope="module")
def tables(script):
    return script("_effects_tables")


def batches(script, filling, *options):
    """Frozen batches by their options, and states of the first."""
    frozen = script("_effects_damper").FrozenBatch
    made = [frozen(filling, one, {**TABLE, "step": STEPS[filling]}) for one in options]
    return made, made[0].states_of_run(3, (4, 3))


def test_a_frozen_batch_goes_on_with_the_bits_of_its_run(script):
    (first, second), states = batches(script, "spheres", {}, {})
    first.freeze(states, 50)
    second.batch.advance((second.batch.steps_per_cycle * 4).astype(int))
    second.batch.advance(50)
    wanted = second.batch.snapshot(3)
    for _ in range(2):
        assert first.seconds(0) > 0.0
        for name, values in first.batch.snapshot(3).items():
            assert np.array_equal(values, wanted[name]), name


def test_options_stay_those_of_the_batch(script):
    (_, other), states = batches(script, "spheres", {}, {"friction": 0.0})
    other.freeze(states, 5)
    assert other.batch.device.pair_contacts.contact[0].friction == 0.0
    assert other.batch.device.wall_contacts.contact[0].friction == 0.5


def test_without_static_contact_the_same_grains_are_released_where_they_are(script):
    (held, free), states = batches(script, "automaton", {}, {"accounting": "landing"})
    cells = {}
    for name, one in (("held", held), ("free", free)):
        one.freeze(states, 1)
        cells[name] = np.array([kinds(one, state) for state in range(len(states))])
    resting = cells["held"] == HELD
    assert resting.sum() > 5 and not (cells["free"] == HELD).any()
    # Wherever a particle was, there is one.
    assert np.array_equal((cells["held"] < DIRECTIONS) | resting, cells["free"] < DIRECTIONS)


def kinds(frozen, state):
    """Contents of the cells of its scenes in a state; an engine may hold those of others too."""
    frozen._memory().write(frozen.states[state])
    return frozen.batch.engine.table.in_use(frozen.batch.device.cells.kind)


def test_a_state_that_the_filling_does_not_bear_is_refused(script):
    (first,), states = batches(script, "spheres", {})
    lost = {**states[0], "container.state": 1e9 + states[0]["container.state"]}
    with pytest.raises(InputError, match="bear its steps from every state"):
        first.freeze([lost], 70)


COMPLETE = {"seconds": 2e-3, "ratio": 1.0, "low": 1.0, "high": 1.0, "rounds": 9}


def test_what_is_spared_follows_from_the_ratio(tables):
    cost = {"seconds": 5.0, "ratio": 0.8, "low": 0.7, "high": 0.85, "rounds": 9}
    found = tables.costs(cost, COMPLETE, 1000)
    wanted = {
        "step_ms": 1.6,
        "spared_percent": 20.0,
        "spared_least_percent": 15.0,
        "spared_most_percent": 30.0,
        "spared_s": 0.4,
        "rounds": 9,
    }
    assert found == pytest.approx(wanted)
    assert tables.costs(None, COMPLETE, 1000) == dict.fromkeys(wanted)


def test_a_negative_price_is_explained(tables, capsys):
    row = {"group": "blast", "scene": "all effects", "failed": ""}
    ends = dict.fromkeys(("spared_percent", "spared_least_percent", "spared_most_percent"), 0.0)
    complete = {**row, **ends, "sweeps": 2.0, "change_percent": 0.0}
    dear = {"spared_percent": -3.0, "spared_least_percent": -4.0, "spared_most_percent": -2.0}
    cheap = {"spared_percent": -3.0, "spared_least_percent": -4.0, "spared_most_percent": 2.0}
    rows = [
        complete,
        {**complete, **dear, "scene": "without friction", "sweeps": 2.5},
        {**complete, **cheap, "scene": "without softening"},
        {**complete, **dear, "scene": "contact with faces"},
    ]
    tables.show(rows, "The blast")
    said = [line for line in capsys.readouterr().out.splitlines() if "a step" in line]
    assert len(said) == 1
    assert said[0].startswith("friction: a step without it takes more, 3.0 % (2.0 to 4.0): ")
    assert said[0].endswith("2.5 sweeps instead of 2")


@pytest.mark.parametrize("name", ["weak pulse", "weak pulse, no damping"])
def test_a_known_list_leaves_out_nothing(script, name):
    """Runs of the best list miss no effect, up to the time of the blast."""
    costs = script("_effects_costs")
    material, peak, best = costs.KNOWN_LISTS[name]
    scene = costs.scene_of(material, peak, best)
    report = simulate(scene, method=ImplicitDashpots(4e-7), until=2.5e-4, samples=25).report
    assert report.needs == () and report.broken_faces == 0
    assert len(report.effects) == 1 + len(best)
