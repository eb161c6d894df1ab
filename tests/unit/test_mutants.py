"""Every mutant of the table can be made, so that the table says what the suite notices."""

from collections import Counter

from tests.mutants import faults, table

LEAST = {
    **{"bond laws": 15, "stepping and levels": 15, "solved dashpots": 12, "contact and search": 15},
    **{"loads and supports": 8, "account and certificate": 10, "meshes and materials": 8},
    **{"automaton": 12, "spheres": 8, "coupling and rk45": 7, "bars": 10},
}


def test_every_mutant_can_be_made_and_names_tests_that_are_there():
    assert [fault for mutant in table() for fault in faults(mutant)] == []


def test_no_area_of_the_physics_is_forgotten():
    count = Counter(mutant.area for mutant in table())
    assert {area: count[area] for area in LEAST if count[area] < LEAST[area]} == {}
