"""Pictures of a response or a sweep, one function each: ``response.plot``, ``sweep.plot``."""

from typing import Any

from matplotlib.figure import Figure

from ca_damper.plot.response import (
    picture_hysteresis,
    picture_measure,
    picture_peaks,
    picture_rms,
)
from taichi_dem.kit.validation import FileName, choice


class ResponsePlots:
    """Pictures of a response.

    Each function returns a matplotlib figure, which a notebook shows, and writes it as PNG where a
    ``path`` is given (InputError where it cannot).

    Examples
    --------
    ::

        response.plot.curves(path="rms.png")
        response.plot.curves("loss_factor")
    """

    def __init__(self, response: Any):
        self._response = response

    def curves(self, measure: str = "rms", *, path: FileName | None = None) -> Figure:
        """Draw a measure over frequency: median over seeds, shaded from lowest to highest.

        Parameters
        ----------
        measure : str
            Name of a measure of the response; the RMS beside that of the empty container.
        path : str or path, optional
        """
        if choice("measure", measure, self._response.units) == "rms":
            return picture_rms(path, self._response)
        return picture_measure(path, self._response, measure)

    def peaks(self, *, path: FileName | None = None) -> Figure:
        """Draw place and height of the peaks over the particle number."""
        return picture_peaks(path, self._response)


class SweepPlots:
    """Pictures of a sweep; functions as those of ``ResponsePlots``."""

    def __init__(self, sweep: Any):
        self._sweep = sweep

    def hysteresis(self, *, path: FileName | None = None) -> Figure:
        """Draw the RMS over frequency, up and down, each seed a line."""
        return picture_hysteresis(path, {self._sweep.up.label: self._sweep})
