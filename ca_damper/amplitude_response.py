"""Response curves at several amplitudes of the base."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ca_damper.measures import MEASURE_UNITS
from taichi_dem.kit.data_table import Tabulated
from taichi_dem.kit.display import in_brief, listed
from taichi_dem.kit.validation import choice

if TYPE_CHECKING:
    from ca_damper.response import Response


@dataclass(frozen=True, eq=False)
class AmplitudeResponse(Tabulated):
    """A Response for each amplitude of the base, from one batch.

    Returned by ``frequency_response`` for several amplitudes of the base. It has a length, items by
    number, and can be iterated over.

    Parameters
    ----------
    amplitudes : tuple of float
        Amplitudes of the base [m].
    responses : tuple of 'Response'
        A Response for each amplitude; each has the report of the whole batch.
    """

    amplitudes: tuple[float, ...]
    responses: tuple["Response", ...]

    def __repr__(self) -> str:
        amplitudes = f"base amplitudes {listed([1e3 * a for a in self.amplitudes])} mm"
        return in_brief(self, amplitudes, self.responses[0].axes_in_words())

    def __len__(self) -> int:
        return len(self.responses)

    def __getitem__(self, k: int) -> "Response":
        return self.responses[k]

    def __iter__(self) -> Iterator["Response"]:
        return iter(self.responses)

    def measure(self, name: str) -> np.ndarray:
        """Measure of all responses by name, stacked by amplitude.

        Parameters
        ----------
        name : str
            Name of a measure of a Response, such as ``"rms"``.

        Returns
        -------
        ndarray
            Values, shape (amplitudes, particles, ratios, seeds), in the unit of the measure.
        """
        choice("name", name, MEASURE_UNITS)
        return np.stack([getattr(one, name) for one in self.responses])

    def peaks(self) -> tuple[np.ndarray, np.ndarray]:
        """Locate the peak of each curve.

        Returns
        -------
        tuple of (ndarray, ndarray)
            Frequency ratio f/f0 [-] and RMS displacement [m] of the peaks, each of shape
            (amplitudes, particles, seeds); NaN where a peak lies outside the ratios.
        """
        ratio, rms = zip(*(one.peaks() for one in self.responses))
        return np.stack(ratio), np.stack(rms)

    def columns(self) -> dict[str, Any]:
        """A row a scene, as of ``Response.columns``, with its amplitude in front.

        Returns
        -------
        dict
            Columns by name, which ends in the unit.
        """
        columns = [one.columns() for one in self.responses]
        sizes = [len(one["filling"]) for one in columns]
        joined = {name: np.concatenate([one[name] for one in columns]) for name in columns[0]}
        amplitude = np.repeat(self.amplitudes, sizes)
        return {"base_amplitude_m": amplitude, **joined}

    def to_xarray(self) -> Any:
        """As ``Response.to_xarray``, over base_amplitude [m] too.

        Returns
        -------
        xarray.Dataset
            Units in the attributes of each variable.
        """
        import xarray

        axis = xarray.Variable("base_amplitude", list(self.amplitudes), {"units": "m"})
        return xarray.concat([one.to_xarray() for one in self.responses], axis)
