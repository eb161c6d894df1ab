"""Response curves at several amplitudes of the base."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from taichi_dem.kit.display import in_brief, listed
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.validation import FileName

if TYPE_CHECKING:
    from ca_damper.response import Response


@dataclass(frozen=True, eq=False)
class AmplitudeResponse:
    """A Response for each amplitude of the base, from one batch.

    amplitudes: of the base [m]. responses: in their order; each has the report of all.
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
        """A measure of a Response by name, (amplitudes, particles, ratios, seeds)."""
        return np.stack([getattr(one, name) for one in self.responses])

    def peaks(self) -> tuple[np.ndarray, np.ndarray]:
        """Where each curve peaks: (ratio, rms [m]), two arrays (amplitudes, particles, seeds)."""
        ratio, rms = zip(*(one.peaks() for one in self.responses))
        return np.stack(ratio), np.stack(rms)

    def write_csv(self, path: FileName) -> None:
        """Write one row a scene, as ``Response.write_csv``, with its amplitude in front.

        Raises InputError when the file cannot be written.
        """
        columns = [one.columns() for one in self.responses]
        sizes = [len(one["filling"]) for one in columns]
        joined = {name: np.concatenate([one[name] for one in columns]) for name in columns[0]}
        write_csv(path, {"base_amplitude_m": np.repeat(self.amplitudes, sizes), **joined})
