"""What a run of the damper says of its error for nothing: order, momentum, sampling of the mean."""

import json

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Empty,
    Oscillator,
    RigidMass,
    SceneTable,
    Spheres,
    frequency_response,
)
from ca_damper.steady_state import mean_and_error
from taichi_dem.kit.accuracy.student import t_quantile

#: Steps at each of which the error is taken as RMS over 16 steps of about that length; halvings.
COUNT, HALVINGS = 16, 4
FILLINGS = [
    (Spheres(), 1, 1.6e-5),
    (Spheres(), 3, 1.6e-5),
    (Automaton(), 1, 2e-4),
    (RigidMass(), 10, 1e-3),
    (Empty(), 0, 1e-3),
]


def errors(filling, particles, step):
    """Error of the RMS of the first cycle, by step; the truth is that of a step 64 times finer.

    A contact that begins somewhere in its step makes each error a matter of chance: 16 steps
    between three quarters of a length and itself share it.
    """
    lengths = [step / 2**k * np.linspace(1.0, 0.75, COUNT) for k in range(HALVINGS + 1)]
    table = SceneTable(particles, 1, [*np.concatenate(lengths), step / 64.0], 6.0, 1e-3)
    batch = Batch(filling, table, measured_cycles=1)
    batch.start("rest")
    rms = batch.run(0, 1).rms
    return np.sqrt(((rms[:-1] - rms[-1]).reshape(-1, COUNT) ** 2).mean(axis=1))


@pytest.mark.parametrize(("filling", "particles", "step"), FILLINGS)
def test_a_filling_has_the_order_that_it_declares(filling, particles, step):
    """Over four halvings; half an order would be another one.

    The truth's own error, a fourteenth of the least, adds less than 0.03.
    """
    found = errors(filling, particles, step)
    order = np.log2(found[0] / found[-1]) / HALVINGS
    assert abs(order - filling.order) < 0.5, order


@pytest.mark.parametrize("accounting", ["landing", "landing+ejection"])
def test_an_automaton_that_leaves_impulses_out_declares_no_order(accounting):
    filling = Automaton(rules="paper", accounting=accounting)
    assert filling.order is None
    report = Batch(filling, SceneTable(1, 1, 1e-4, 6.0, 1e-3)).report()
    assert report.known_error.startswith("step 0.0001 s, order unknown; momentum closes to ")


def response(filling, particles, **options):
    """Response of a few scenes; its report."""
    question = {"ratios": [0.9, 0.97, 1.05], "seeds": 2, "transient_cycles": 3, "progress": None}
    return frequency_response(filling, particles=particles, **{**question, **options})


def test_a_response_says_how_well_its_highest_mean_is_known(tmp_path):
    """The same mean and error from a batch of the scene that is highest, cycle by cycle."""
    found = response(Automaton(), 20, measured_cycles=16, transient_cycles=100)
    _, ratio, seed = np.unravel_index(np.argmax(found.rms), found.rms.shape)
    oscillator, step = found.oscillator, found.dt[ratio]
    frequency = found.ratios[ratio] * oscillator.natural_frequency
    table = SceneTable(20, found.seeds[seed], step, frequency, oscillator.base_amplitude)
    batch = Batch(Automaton(), table, measured_cycles=16)
    batch.start("rest")
    series = batch.run(100, 16).rms_by_cycle[0]
    mean, error, freedom = mean_and_error(series)
    cycles, share = found.report.sampling
    assert cycles == 16 and freedom == 7
    assert share == pytest.approx(t_quantile(0.95, freedom) * error / mean, rel=1e-9)
    last = f"highest RMS, a mean over 16 cycles, known to {100.0 * share:.2g} %"
    assert found.report.known_error.endswith(f"; {last}")
    assert f"known of the error step {found.dt.min():.3g} to " in str(found.report)
    assert f"\n{' ' * 19}{last}\n" in str(found.report)
    found.report.write(tmp_path / "report.json")
    written = json.loads((tmp_path / "report.json").read_text())
    assert written["known_error"] == found.report.known_error


@pytest.mark.parametrize("damping_ratio", [6e-4, 2e-3, 6e-3])
@pytest.mark.parametrize("transient", [3, 30, 100, 400])
def test_a_mean_that_still_grows_is_not_said_to_be_known(damping_ratio, transient):
    """Where it is said to be known, it is: what is left of the growth is less than the share."""
    own = Oscillator()
    light = Oscillator(damping=2.0 * damping_ratio * np.sqrt(own.stiffness * own.mass))
    question = {"ratios": [1.0], "seeds": 1, "oscillator": light, "transient_cycles": transient}
    found = response(RigidMass(), 0, measured_cycles=20, **question)
    wanted = light.rms(light.natural_frequency)
    off = abs(found.rms[0, 0, 0] / wanted - 1.0)
    if found.report.sampling is None:
        assert "highest RMS not known: it grows by " in found.report.known_error
        assert "known to" not in str(found.report)
    else:
        # An oscillator of the paper's step comes to rounding, and the step's error is 1e-6.
        assert off < max(found.report.sampling[1], 1e-5)


def test_too_few_cycles_do_not_show_whether_a_mean_still_changes():
    report = response(RigidMass(), 10, transient_cycles=300, measured_cycles=7).report
    last = "highest RMS not known: a mean over 7 cycles, 8 show whether it still changes"
    assert report.known_error.endswith(f"; {last}") and report.sampling is None


@pytest.mark.parametrize(("cycles", "amplitude"), [(1, 0.6e-3), (8, 0.0)])
def test_a_mean_of_one_cycle_or_of_nothing_has_no_error_to_tell(cycles, amplitude):
    still = Oscillator(base_amplitude=amplitude)
    report = response(Empty(), 0, measured_cycles=cycles, oscillator=still).report
    assert report.sampling is None and report.known_error.count(";") == 1


def test_a_steady_response_of_a_rigid_mass_is_known_to_rounding():
    """After 300 cycles at a damping ratio of 0.012, exp(-2 pi 300 0.012) = 1e-10 is left."""
    report = response(RigidMass(), 10, transient_cycles=300, measured_cycles=8).report
    assert report.sampling[1] < 1e-8 and report.order == 1
