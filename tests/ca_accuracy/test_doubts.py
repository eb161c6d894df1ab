"""An answer of the damper is not reached where a certificate of its runs does not hold."""

from dataclasses import replace

import pytest

from ca_damper import RigidMass, goals, solve_response
from ca_damper.batch import Batch
from ca_damper.certificate import Certificate
from taichi_dem.kit.audit import Audit


@pytest.mark.parametrize("misses", [0, 1])
def test_a_certificate_that_does_not_hold_is_never_reached(monkeypatch, misses):
    audit = Audit(10_000, 100, misses, "contact tests")
    monkeypatch.setattr(Batch, "certificate", Certificate("listed", 1, audit=audit))
    answer = solve_response(RigidMass(), particles=3, goal=goals.rms_at(1.0))
    assert answer.reached == (not misses)
    assert ("search='cells', which skips no contact test" in answer.shortfall) == bool(misses)


def test_a_certificate_with_misses_says_so():
    found = Certificate("listed", 1, audit=Audit(10_000, 100, 2, "contact tests"))
    assert not found.holds and "an audit of 100 skipped contact tests found 2 misses" in str(found)
    assert replace(found, audit=None).holds and replace(found, audit=Audit(10, 10, 0)).holds
