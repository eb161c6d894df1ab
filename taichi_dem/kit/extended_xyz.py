"""Extended XYZ: particles over time as text, for OVITO and ASE."""

import io
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from taichi_dem.kit.files import write_text
from taichi_dem.kit.validation import FileName

#: Nine digits after the first: a place in a metre to a tenth of a nanometre.
_NUMBER = "%.10g"
_SPECIES = "X"


class XyzFrame(NamedTuple):
    """Particles at one time.

    time_s: [s]. columns: arrays (n,) or (n, k) by name, in the names of OVITO: pos, velo, radius,
    orientation (quaternions x, y, z, w); whole numbers stay such. low, size: corner and edges of
    the box around them (3,) [m], drawn as a cell that is not periodic.
    """

    time_s: float
    columns: Mapping[str, np.ndarray]
    low: Sequence[float]
    size: Sequence[float]


def write_extended_xyz(path: FileName, frames: Iterable[XyzFrame]) -> None:
    """Write frames one after the other.

    Parameters
    ----------
    path : str or path
        Name of the file, such as ``"run.xyz"``.
    frames : iterable of XyzFrame
        The number of particles may differ from frame to frame.

    Raises
    ------
    InputError
        Where the file cannot be written.

    Notes
    -----
    Lengths in m, velocities in m/s, time in s, as everywhere here; readers that know atoms will
    say angstrom. The first column, which they ask for, names ASE's element of no kind.
    """
    write_text(path, "".join(_frame_text(frame) for frame in frames))


def _frame_text(frame):
    arrays = {n: np.asarray(v).reshape(len(v), -1) for n, v in frame.columns.items()}
    whole = {name: np.issubdtype(array.dtype, np.integer) for name, array in arrays.items()}
    kinds = [f"{n}:{'I' if whole[n] else 'R'}:{a.shape[1]}" for n, a in arrays.items()]
    lattice = " ".join(_NUMBER % x for x in np.diag(frame.size).ravel())
    origin = " ".join(_NUMBER % x for x in frame.low)
    head = (
        f'Lattice="{lattice}" Origin="{origin}" pbc="F F F" Time={frame.time_s:.10g} '
        f"Properties=species:S:1:{':'.join(kinds)}"
    )
    formats = [form for n, a in arrays.items() for form in a.shape[1] * [_format(whole[n])]]
    rows = io.StringIO()
    count = len(next(iter(arrays.values())))
    if count:
        np.savetxt(rows, np.hstack(list(arrays.values())), fmt=" ".join([_SPECIES, *formats]))
    return f"{count}\n{head}\n{rows.getvalue()}"


def _format(whole):
    return "%d" if whole else _NUMBER
