"""The same with all kinds of methods: several or controlled steps, limited or solved dashpots."""

import numpy as np
import pytest

from taichi_dem import ImplicitDashpots, Multirate, StepControl, Uniform
from tests.activation.late_runs import BITS, NAMES, run
from tests.activation.late_scenes import STEP, late_scene

#: The largest steps are twice those of the uniform runs, and bodies take down to a sixteenth.
WAY = 1e-7
METHODS = {
    "implicit": ImplicitDashpots(STEP, refresh=1e-5),
    "limited": Uniform(STEP, dashpot="limited"),
    "held": Multirate(2.0 * STEP, WAY),
    "drifted": Multirate(2.0 * STEP, WAY, "drifted"),
    "controlled": Multirate(
        2.0 * STEP, 10.0 * WAY, control=StepControl(dashpot_floor=STEP / 8.0), dashpot="limited"
    ),
}
#: Scenes in which the bond that needs a law is clearly ahead of the others.
NAMED = ("far_end 0", "far_end_slips 2", "thrown 0", "hit 0", "flight 0", "fragment 0", "aside 0")
#: Each compiles two engines.
pytestmark = pytest.mark.slow


def runs(method, name):
    """Runs with all effects, and with those on demand, without sleep and with it."""
    step = METHODS[method]
    return (
        run(name, "all", method=step),
        run(name, method=step, sleep=0.0),
        run(name, method=step),
    )


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("method", METHODS)
def test_without_sleep_all_bits_are_those_of_all_effects(method, name):
    every, auto, _ = runs(method, name)
    assert [key for key in BITS if not np.array_equal(auto.fields[key], every.fields[key])] == []
    assert np.array_equal(auto.fields["level"], every.fields["level"])
    assert auto.acting == every.acting
    assert auto.report.energy_balance == every.report.energy_balance


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("method", METHODS)
def test_sleep_finds_what_acts(method, name):
    every, _, auto = runs(method, name)
    apart = np.abs(auto.fields["position"] - every.fields["position"]).max()
    assert apart <= 1e-3 * every.way
    assert set(auto.acting) == set(every.acting) >= {NAMES[late_scene(name).role]}
    assert np.array_equal(auto.fields["broken_tick"] >= 0, every.fields["broken_tick"] >= 0)


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("method", METHODS)
def test_certificates_hold(method, name):
    for made in runs(method, name)[1:]:
        certificate = made.report.certificate
        assert certificate.holds, certificate
        assert made.report.linear_momentum_error <= 1e-12


@pytest.mark.parametrize("method", METHODS)
def test_where_it_is_not_needed_it_never_acts(method):
    for name in ("far_end 0", "far_end_slips 2", "flight 0"):
        twin = run(name, needed=False, method=METHODS[method])
        assert NAMES[late_scene(name).role] not in twin.acting
