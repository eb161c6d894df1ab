"""A Signal from measured samples, after checks that a spline can represent them.

Between samples of any kind, the quantity is the cubic spline through them. It follows a component
that is sampled at least four times a cycle: its gain sinc^4(f) 3 / (2 + cos(2 pi f)), f by the
sampling rate, is then within 1.5 % of 1, at eight times within 0.06 %, and the image at 1 - f has
at most 1.3 % of its amplitude. So 99 % of the power must lie below a quarter of that rate.

Accelerations and velocities are integrated from nodes that lie closer than their samples. Straight
lines from node to node of an acceleration lose (w h)^2 / 12 of a component, 5 % of one with eight
nodes a cycle; so h^2 / 12 of the second derivative is added, which leaves (w h)^4 / 240.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ca_damper.excitation.signal import MOST_NODES, Signal, end_slope, integral, nodes, spline
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import between, choice, flag, told_apart

#: What samples are of: the signal itself, its first or its second derivative.
OF = ("value", "velocity", "acceleration")
#: Distance of a time from the even grid, as a share of the step: times may be rounded.
_UNEVEN = 0.1
#: Distance that is rounding, as a share of the largest time.
_ROUNDED = 1e-12
#: Steps from sample to sample that are a gap.
_GAP = 1.5
#: Samples that a cycle needs, and the share of the power in slower cycles.
SAMPLES_A_CYCLE, POWER_SHARE = 4.0, 0.99
#: Nodes from sample to sample of what is integrated.
REFINED = 8


def from_samples(
    time_s: Any,
    values: Any,
    *,
    of: str = "value",
    correct_baseline: bool = False,
    highpass: float | None = None,
    resample: float | None = None,
) -> Signal:
    """Signal through measured samples; its own time counts from the first of them.

    Parameters
    ----------
    time_s : array_like
        Ascending times [s], shape (samples,); evenly spaced unless ``resample`` is given.
    values : array_like
        Samples, shape (samples,), of the kind that ``of`` names.
    of : str, default "value"
        ``"value"``: of the signal itself, such as a displacement [m] or a force [N].
        ``"velocity"``: of its derivative [m/s], which is integrated from zero. ``"acceleration"``:
        of its second derivative [m/s^2], which is integrated twice from rest.
    correct_baseline : bool, default False
        Subtract from an acceleration the straight line that makes the motion end at rest where it
        began: for a record with an offset, which integrates to a large drift. Do not use it for a
        shock, which changes the speed for good. A report says what was done.
    highpass : float, optional
        Frequency below which the samples are drift [Hz], from one cycle in the record to a quarter
        of the sampling rate: SciPy's Butterworth filter of order two, forwards and backwards, whose
        gain at f is 1 / (1 + (highpass / f)^4).
    resample : float, optional
        Step [s] of even times at which the cubic spline through the samples is taken, at most the
        usual step between them. A report names each gap; one longer than a quarter of the
        structure's period is refused where the structure is known.

    Returns
    -------
    Signal
        Cubic spline through the samples, or the integral of one: within 0.1 % of what a structure
        does that is sampled eight times a period or more. A report says where it is not.

    Examples
    --------
    >>> time = np.linspace(0.0, 1.0, 1001)
    >>> from_samples(time, 1e-3 * np.sin(2 * np.pi * 5 * time)).duration
    1.0
    """
    choice("of", of, OF)
    flag("correct_baseline", correct_baseline)
    times, samples = nodes("time_s", time_s), nodes("values", values)
    if len(times) != len(samples):
        raise InputError(f"values must be {len(times)}, as many as times, got {len(samples)}")
    done, gap = [], 0.0
    if resample is not None:
        times, samples, gap, words = _resampled(times, samples, resample)
        done.append(words)
    step = float(times[-1] - times[0]) / (len(times) - 1)
    done.append(_evened(times, step))
    if highpass is not None:
        samples, words = _without_drift(step, samples, highpass)
        done.append(words)
    _check_spectrum(step, samples)
    motion, words = _integrated(step, samples, of, correct_baseline)
    return replace(motion, treated="; ".join(filter(None, (*done, words))), apart=step, gap=gap)


def _resampled(times, samples, step):
    """Even times, the spline through the samples there, the longest gap [s], and words."""
    from scipy.interpolate import CubicSpline

    steps = np.diff(times)
    if not steps.min() > 0.0:
        k = int(steps.argmin()) + 1
        raise InputError(
            f"times must ascend, got {times[k]:.9g} s after {times[k - 1]:.9g} s in sample {k + 1}"
        )
    usual = float(np.median(steps))
    least = float(times[-1] - times[0]) / MOST_NODES
    step = between("resample", step, least, max(least, usual))
    gaps = steps > _GAP * usual
    each = [f"{one:.4g} s after {at:.6g} s" for one, at in zip(steps[gaps], times[:-1][gaps])]
    count = int((times[-1] - times[0]) / step * (1.0 + _ROUNDED))
    even = times[0] + step * np.arange(count + 1)
    words = f"taken every {step:.4g} s from a spline, gaps: {', '.join(each) or 'none'}"
    return even, CubicSpline(times, samples)(even), steps[gaps].max(initial=0.0), words


def _without_drift(step, samples, highpass):
    """Samples after a high-pass filter that keeps phases, and words."""
    from scipy import signal

    between("highpass", highpass, 1.0 / (step * (len(samples) - 1)), 0.25 / step)
    sections = signal.butter(2, highpass, "highpass", fs=1.0 / step, output="sos")
    # Mirrored at its ends, the record keeps its mean there; three cycles let the filter forget.
    around = min(len(samples) - 1, int(3.0 / (step * highpass)))
    left = signal.sosfiltfilt(sections, samples, padtype="even", padlen=around)
    mean, taken = samples.mean(), (samples - left).std()
    words = (
        f"high-pass filtered at {highpass:g} Hz, which takes a mean of {mean:.3g} and "
        f"{taken:.3g} RMS of {samples.std():.3g}"
    )
    return left, words


def _integrated(step, samples, of, correct_baseline):
    if of == "value":
        return spline(step, samples, "samples"), ""
    fine, (value, _, bend) = _refined(step, samples)
    if of == "velocity":
        # Of the cubic through both values and second derivatives of an interval.
        areas = 0.5 * (value[:-1] + value[1:]) - fine**2 / 24.0 * (bend[:-1] + bend[1:])
        travel = fine * np.concatenate([[0.0], np.cumsum(areas)])
        return spline(fine, travel, "samples"), "integrated from zero"
    pull = value - fine**2 / 12.0 * bend
    if correct_baseline:
        return _at_rest_again(fine, pull)
    treated = "integrated twice from rest, without a base line correction"
    return integral(fine, pull, "samples"), treated


def _refined(step, samples):
    """Step and, at ``REFINED`` nodes from sample to sample, the spline with its derivatives."""
    most = 1 + (MOST_NODES - 1) // REFINED
    if len(samples) > most:
        raise InputError(
            f"values must be at most {most} of a velocity or acceleration, got {len(samples)}: "
            "read one part at a time"
        )
    fine = step / REFINED
    time = fine * np.arange(REFINED * (len(samples) - 1) + 1)
    return fine, spline(step, samples, "samples").at(time)


def _evened(times, step):
    """By how much evenly spaced times were evened, in words."""
    steps = np.diff(times)
    late = np.abs(times - times[0] - step * np.arange(len(times)))
    if not late.max() <= _UNEVEN * step:
        usual = float(np.median(steps))
        k = int(np.abs(steps - usual).argmax()) + 1
        raise InputError(
            f"times must ascend evenly, to {_UNEVEN:g} of their step of {usual:g} s, got "
            f"{times[k]:.9g} s after {times[k - 1]:.9g} s in sample {k + 1}: read one part at a "
            f"time, or give resample={usual:.4g}"
        )
    is_even = late.max() <= _ROUNDED * max(step, abs(times[0]), abs(times[-1]))
    return "" if is_even else f"times evened by up to {late.max():.2g} s"


def _check_spectrum(step, samples):
    """InputError unless nearly all of the power lies where a spline through nodes follows."""
    from scipy import signal

    count = len(samples)
    options = {"window": "hann", "detrend": "linear", "scaling": "spectrum"}
    frequency, power = signal.periodogram(samples, 1.0 / step, **options)
    # What a straight line leaves of one is rounding, which has no spectrum.
    if count * power.sum() <= 1e-20 * (samples**2).mean():
        return
    most = float(frequency[np.searchsorted(np.cumsum(power), POWER_SHARE * power.sum())])
    # To within the width of the window's lobe.
    if most > 1.0 / (SAMPLES_A_CYCLE * step) + 2.0 / (count * step):
        got, allowed = told_apart(step, 1.0 / (SAMPLES_A_CYCLE * most))
        raise InputError(
            f"the step of the samples must be at most {allowed} s, as {100 * POWER_SHARE:g} % of "
            f"their power reaches to {most:.4g} Hz, got {got} s"
        )


def _at_rest_again(step, samples):
    """Double integral less that of the line a + b t that lets it end at rest in zero, and words."""
    # At the end T the line a + b t has the speed a T + b T^2 / 2 and the place a T^2 / 2 + b T^3 /
    # 6.
    rough = integral(step, samples, "samples")
    total, speed, place = rough.duration, end_slope(rough), float(rough.value[-1])
    slope = 6.0 * (speed * total - 2.0 * place) / total**3
    offset = speed / total - 0.5 * slope * total
    line = offset + slope * step * np.arange(len(samples))
    treated = (
        "integrated twice from rest, less a base line of acceleration from "
        f"{line[0]:.3g} to {line[-1]:.3g} m/s^2 that takes {speed:.3g} m/s and {place:.3g} m away"
    )
    return integral(step, samples - line, "samples"), treated
