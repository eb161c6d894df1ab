"""A response in a notebook: curves and a table of peaks, whatever the numbers."""

import numpy as np
import pytest

from ca_damper import Oscillator
from tests.made_response import response
from tests.notebook import shown


def test_a_notebook_shows_curves_and_peaks():
    """10 grains of 0.2 g on 86 g: the peak falls to sqrt(86 / 88) f0 = 0.9886 f0."""
    page, pixels = shown(response())
    assert pixels.shape[1] > 600 and pixels.std() > 5.0
    assert "particles 0, 10" in page.text and "2 seeds" in page.text
    ratio, rms = (values[1] for values in response().peaks())
    assert ratio == pytest.approx((86.0 / 88.0) ** 0.5, abs=3e-4)
    for words in (f"{ratio[0]:.4f}", f"{6.0287 * ratio[0]:.3f}"[:4], f"{1e3 * rms.max():.4g}"):
        assert words in page.text, words


def holes():
    """Every other scene's RMS is no number."""
    rms = response().rms.copy()
    rms[:, ::2] = np.nan
    return response(rms=rms)


ODD = {
    "one scene": lambda: response((0,), np.array([1.0]), (1,)),
    "all NaN": lambda: response(rms=np.full((2, 41, 2), np.nan)),
    "some NaN": holes,
    "at rest": lambda: response(rms=np.zeros((2, 41, 2))),
    "infinite": lambda: response(rms=np.full((2, 41, 2), np.inf)),
    # A natural frequency at which the transfer function divides by zero, to the bit.
    "no damping": lambda: response(
        ratios=np.array([1.0, 1.1]), oscillator=Oscillator(1.0, 1.0, damping=0.0)
    ),
    "no motion": lambda: response(oscillator=Oscillator(base_amplitude=0.0)),
}


@pytest.mark.parametrize("how", ODD)
def test_an_odd_response_is_shown_all_the_same(how):
    """Warnings are errors here."""
    odd = ODD[how]()
    shown(odd)
    assert len(repr(odd)) < 500


def test_of_many_particle_numbers_a_few_are_shown():
    page, _ = shown(response(tuple(range(300))))
    assert "8 of 300 particle numbers" in page.text and page.text.count(" to ") < 20


def test_a_label_is_no_tag():
    page, _ = shown(response(label='<script>"x" & $y'))
    assert '<script>"x" & $y' in page.text and "script" not in page.tags
