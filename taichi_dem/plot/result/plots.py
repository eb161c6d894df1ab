"""Pictures of a result, one function each: ``result.plot``."""

from collections.abc import Sequence
from typing import Optional

from matplotlib.figure import Figure

from taichi_dem.kit.validation import FileName, positive, unit_vector
from taichi_dem.output.run_tables import RunTables
from taichi_dem.plot.block import plot_cracks
from taichi_dem.plot.bodies import ALONG_Z
from taichi_dem.plot.result.pictures import (
    plot_attenuation,
    plot_block,
    plot_columns,
    plot_energy_shares,
    plot_fragments,
    plot_rose,
)
from taichi_dem.plot.series import plot_energy, plot_history

#: Columns that are drawn where there is no hole to look at.
_PLAIN = ("largest_speed_m_s", "broken_faces", "smallest_step_s")
#: Radii of a hole from which on its crushed zone does not matter.
_NEAREST = 4.0


class ResultPlots:
    """Pictures of a result.

    Each function returns a matplotlib figure, which a notebook shows, and writes it as PNG where
    a ``path`` is given (InputError where it cannot).

    Examples
    --------
    ::

        result.plot.energy(path="energy.png")
        result.plot.block(colour="damage", magnify=5.0)
    """

    def __init__(self, result: RunTables):
        self._result = result

    def history(
        self, names: Optional[Sequence[str]] = None, *, path: Optional[FileName] = None
    ) -> Figure:
        """Draw columns of the history over time.

        Parameters
        ----------
        names : sequence of str, optional
            Columns of ``result.history``; by default displacement of the hole or largest speed,
            broken faces, smallest step.
        path : str or path, optional
        """
        history = self._result.history
        if names is None and "hole_radial_displacement_mm" in history:
            return plot_history(path, history)
        return plot_columns(path, history, _PLAIN if names is None else names)

    def energy(self, *, path: Optional[FileName] = None) -> Figure:
        """Draw the terms of the energy balance over time, and what is unexplained."""
        return plot_energy(path, self._result.history)

    def energy_shares(self, *, path: Optional[FileName] = None) -> Figure:
        """Draw every term of the energy balance as a share of the energy given, over time."""
        return plot_energy_shares(path, self._result.energy_shares())

    def cracks(
        self,
        frame: int = -1,
        *,
        magnify: float = 5.0,
        axis: Sequence[float] = ALONG_Z,
        path: Optional[FileName] = None,
    ) -> Figure:
        """Draw broken faces by time of breaking, at rest and as the block is in a frame.

        Parameters
        ----------
        frame : int
            Number of the frame.
        magnify : float
            Factor of the displacement in the middle panel.
        axis : sequence of 3 floats
            Towards the viewer.
        path : str or path, optional
        """
        one, magnify = self._result.frame(frame), positive("magnify", magnify)
        axis, times = unit_vector("axis", axis).tolist(), self._result.broken_time
        return plot_cracks(path, self._result.model, one, times, magnify, axis)

    def crack_area(self, *, path: Optional[FileName] = None) -> Figure:
        """Draw the area of all cracks over time."""
        return plot_columns(path, self._result.crack_area(), ["crack_area_m2"])

    def fragments(self, frame: int = -1, *, path: Optional[FileName] = None) -> Figure:
        """Draw the share of the mass that passes a sieve over its opening, in a frame."""
        return plot_fragments(path, self._result.fragments(frame))

    def rose(
        self,
        axis: Sequence[float] = ALONG_Z,
        *,
        sectors: int = 36,
        path: Optional[FileName] = None,
    ) -> Figure:
        """Draw crack area by direction in a plane; arguments as of ``Result.rose``."""
        return plot_rose(path, self._result.rose(axis, sectors))

    def attenuation(
        self,
        group: Optional[str] = None,
        *,
        nearest: float = _NEAREST,
        path: Optional[FileName] = None,
    ) -> Figure:
        """Draw peak velocities over the distance from a hole, with a power law.

        Parameters
        ----------
        group : str, optional
            Face group of the hole's wall, as of ``Result.attenuation``.
        nearest : float
            Distance from which on the law is fitted [radii of the hole].
        path : str or path, optional
        """
        found = self._result.attenuation(group)
        return plot_attenuation(path, found, positive("nearest", nearest))

    def block(
        self,
        frame: int = -1,
        *,
        colour: str = "speed",
        magnify: float = 1.0,
        axis: Sequence[float] = ALONG_Z,
        path: Optional[FileName] = None,
    ) -> Figure:
        """Draw the bodies in a frame, coloured by a value.

        Parameters
        ----------
        frame : int
            Number of the frame.
        colour : {"speed", "peak_speed", "displacement", "damage", "level", "fragment"}
            ``taichi_dem.output.body_values.COLOURS``.
        magnify : float
            Factor of the displacement.
        axis : sequence of 3 floats
            Towards the viewer.
        path : str or path, optional
        """
        magnify, axis = positive("magnify", magnify), unit_vector("axis", axis).tolist()
        return plot_block(path, self._result, self._result.frame(frame), colour, magnify, axis)
