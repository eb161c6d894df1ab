"""Values wait until all fields are made, so that a simulation takes one group of Taichi's."""

import pytest
from taichi.lang import impl

from taichi_dem import InputError, Multirate, Simulation
from taichi_dem.kit import allocation
from tests.scenes import brisk_scene


def groups():
    """Groups of fields that the session holds."""
    return impl.get_runtime().prog.get_snode_tree_size()


def test_values_wait_until_the_outermost_block_ends():
    """And come in the order in which they were given; without a block they come at once."""
    seen = []
    allocation.defer_fill(seen.append, "at once")
    with allocation.batch_allocation():
        allocation.defer_fill(seen.append, "first")
        with allocation.batch_allocation():
            allocation.defer_fill(seen.append, "second")
        assert seen == ["at once"]
    assert seen == ["at once", "first", "second"]


def test_what_an_error_leaves_waiting_is_forgotten():
    seen = []
    with pytest.raises(ZeroDivisionError), allocation.batch_allocation():
        allocation.defer_fill(seen.append, "never")
        raise ZeroDivisionError
    allocation.defer_fill(seen.append, "at once")
    assert seen == ["at once"]


@pytest.mark.slow
def test_a_simulation_takes_one_group_of_fields():
    """Two, were one of its fields declared after another was used; a session bears 512."""
    before = groups()
    Simulation(brisk_scene(), Multirate(1e-8, 2e-7)).start()
    assert groups() == before + 1


def test_a_session_at_its_limit_is_said_in_words(monkeypatch):
    Simulation(brisk_scene(), Multirate(1e-8, 2e-7))
    monkeypatch.setattr(allocation, "MOST_TREES", 0)
    with pytest.raises(InputError, match=r"must stay below 0, got \d+: call runtime.stop"):
        Simulation(brisk_scene(), Multirate(1e-8, 2e-7))
