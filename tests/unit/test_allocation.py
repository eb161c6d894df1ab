"""How many groups of Taichi's fields a session takes."""

import pytest
from taichi.lang import impl

from taichi_dem import InputError, Multirate, Simulation
from taichi_dem.kit import allocation
from tests.scenes import brisk_scene


def groups():
    """Groups of fields that the session holds."""
    return impl.get_runtime().prog.get_snode_tree_size()


def test_an_engine_takes_one_group_of_fields(compiled_anew):
    """And another scene of its structure none; a session bears 512."""
    before = groups()
    Simulation(brisk_scene(), Multirate(1e-8, 2e-7)).start()
    # Taichi's own root, empty, is finalized with the first kernel.
    assert groups() <= before + 2
    between = groups()
    Simulation(brisk_scene(), Multirate(2e-8, 1e-7)).start()
    assert groups() == between


def test_a_session_at_its_limit_is_said_in_words(monkeypatch, compiled_anew):
    monkeypatch.setattr(allocation, "MOST_TREES", 0)
    with pytest.raises(InputError, match=r"must stay below 0, got \d+: call runtime.clear"):
        Simulation(brisk_scene(), Multirate(1e-8, 2e-7))
