"""Search of a peak on curves that are known exactly."""

import math

import numpy as np
import pytest

from ca_damper import Oscillator
from ca_damper.accuracy.peak_search import PeakSearch


class Curve:
    """RMS of an oscillator with more mass [kg]; counts what it is asked for."""

    def __init__(self, damping_ratio, added=0.0):
        self.oscillator = Oscillator(damping=2.0 * damping_ratio * math.sqrt(123.4 * 0.086))
        self.added, self.asked = added, []

    def __call__(self, ratios):
        self.asked += ratios
        natural = self.oscillator.natural_frequency
        return self.oscillator.rms(np.array(ratios) * natural, self.added).tolist()


@pytest.mark.parametrize("damping", [0.0006, 0.0123, 0.05])
@pytest.mark.parametrize("added", [0.0, 0.032])
def test_the_peak_is_found_and_resolved_with_few_frequencies(damping, added):
    curve = Curve(damping, added)
    ratio, lattice, level = PeakSearch(curve, 0.7, 1.04, True).run()
    wanted, height = curve.oscillator.peak(added)
    assert ratio == pytest.approx(wanted, abs=0.3 * damping)
    around = lattice.around(ratio, level)
    rms = curve.oscillator.rms(np.array(around) * curve.oscillator.natural_frequency, added)
    assert 3 <= len(around) <= 4 and around[0] < wanted < around[-1]
    # Neighbours stand on the resonance: half of the peak or more.
    assert rms.min() > 0.5 * height
    assert set(around) <= set(curve.asked) and len(set(curve.asked)) == len(curve.asked) <= 24
