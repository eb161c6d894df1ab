"""Solved dashpots on the brisk block: momentum, order, energy, colours and search by fracture."""

import numpy as np
import pytest

from taichi_dem import ImplicitDashpots
from taichi_dem.contact_search.search import LOOKED
from taichi_dem.step.implicit.pairs import COLOURS
from tests.again import Again
from tests.scenes import brisk_scene
from tests.unit.test_broad_phase import expected, listed, near_slots
from tests.unit.test_colouring import is_proper

EPS = np.finfo(float).eps
STEP, UNTIL = 4e-7, 4e-5


@pytest.fixture(scope="module")
def block():
    """The brisk block, compiled once; sweeps until they add little to what is measured."""
    return Again(brisk_scene(), ImplicitDashpots(STEP, sweeps=(2, 100), tolerance=1e-5))


def after(block, step, until):
    """The block at a time [s], by steps of a length [s]: its report."""
    block.restart(step)
    block.run(round(until / step))
    return block.simulation.report()


@pytest.fixture(scope="module")
def reports(block):
    """Reports at UNTIL by two steps."""
    return [after(block, step, UNTIL) for step in (STEP, STEP / 2)]


@pytest.mark.slow
def test_momentum_is_kept_through_fracture_and_contact(reports):
    """As in ``test_conservation``: sqrt(updates) eps of what was exchanged, at most.

    Each body takes an impulse and its partner the opposite, bit for bit, in every visit; visits
    round the velocity, to eps of its size, and are few against the updates' own sums.
    """
    for report in reports:
        assert report.broken_faces > 100 and report.pair_evaluations > 1e5
        bound = EPS * np.sqrt(report.body_updates / report.body_count)
        assert report.linear_momentum_error < bound
        assert report.angular_momentum_error < bound


def test_ledger_residual_halves_with_the_step(reports):
    """Fracture and contact are met up to a step late, and sweeps end within their tolerance.

    Energies are of one time: no half step of power is left, which was STEP / UNTIL / 2 of the work.
    """
    coarse, fine = (abs(report.energy_balance["residual"]) for report in reports)
    assert fine < coarse
    assert reports[0].energy_residual_fraction < 0.25 * 0.5 * STEP / UNTIL


@pytest.mark.parametrize("until, bound", [(8e-6, 0.002), (1.44e-5, 0.02)])
def test_positions_are_of_second_order_before_anything_breaks(block, until, bound):
    """Half the step, a quarter of the difference of two runs: springs, dashpots, gas and slip.

    The next terms are of fourth order as the scheme is symmetric in time: (dt / rise)^2 = 4e-4
    of them at the pulse's rise of 4e-5 s. By the later time five units have softened: what they
    pull has a kink, whose place in the step is of second order too, but not smoothly so.
    """
    places = []
    for step in (8e-7, 4e-7, 2e-7):
        report = after(block, step, until)
        assert report.broken_faces == 0 and report.pair_evaluations == 0
        places.append(block.state.position.to_numpy())
    coarse, fine = (np.linalg.norm(a - b) for a, b in zip(places, places[1:]))
    moved = np.linalg.norm(places[-1] - block.model.centre)
    assert fine > 1e-5 * moved
    assert coarse / fine == pytest.approx(4.0, rel=bound)


def test_touching_pairs_of_a_colour_share_no_body(block):
    """Those listed are just those that touch, each once, in the order of their colours."""
    pairs, contacts, counts = block.simulation.advance.solver.pairs, block.simulation.contacts, []
    skin = contacts.skin.to_numpy()
    block.restart(STEP)
    contacts.skin.fill(4e-3)
    block.search_anew()
    block.run(50)
    for step in range(50, 250):
        searches = block.simulation.searches
        block.run(step + 1)
        if block.simulation.searches > searches:
            # A search after the step numbers the pairs anew.
            continue
        count = pairs.count[None]
        counts.append(count)
        active, order = pairs.active.to_numpy()[:count], pairs.order.to_numpy()[:count]
        slots = near_slots(contacts.store)
        touching = pairs.touching.to_numpy()[slots]
        assert active.tolist() == slots[touching > 0].tolist()
        colours = pairs.colour.to_numpy()[:count]
        assert colours.max(initial=0) < COLOURS
        assert count == 0 or is_proper(contacts.store.body.to_numpy()[active], colours)
        assert order.tolist() == np.argsort(colours, kind="stable").tolist()
        first = pairs.colour_first.to_numpy()[: COLOURS + 1]
        assert first.tolist() == np.searchsorted(colours[order], np.arange(COLOURS + 1)).tolist()
    contacts.skin.from_numpy(skin)
    assert len(counts) > 20 and max(counts) > 50 and colours.max() > 0


def test_a_search_after_a_break_finds_all_that_touches(block):
    """Spheres that overlap, by all against all, are candidates after every search.

    So are all that two bodies can bring together before one of them is looked at again. A search
    looks at bodies that a break has exposed or that have moved, few of all.
    """
    simulation, looked, touching = block.simulation, [], []
    contacts = simulation.contacts

    def look():
        looked.append((simulation.broad_phase.looked.to_numpy() == LOOKED).sum())
        if len(looked) % 4 == 0:
            touching.append(expected(simulation, 0.0))
            left = contacts.body_skin.to_numpy() - contacts.travel.to_numpy()
            near = expected(simulation, np.maximum(left, 0.0))
            assert touching[-1] <= near <= set(listed(simulation))

    block.restart(STEP)
    block.run(200, look)
    assert len(looked) > 60 and len(touching[-1]) > 100
    assert np.median(looked) < 0.1 * block.model.body_count
    # A search of all bodies lists no sphere more that touches.
    last = set(listed(simulation))
    simulation.broad_phase.search()
    assert expected(simulation, 0.0) <= last & set(listed(simulation))
