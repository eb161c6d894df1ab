"""Tables of results: columns whose names end in their unit, for pandas and xarray."""

import re
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.files import write_csv
from taichi_dem.kit.validation import FileName

#: Unit by the ending of a name; of two endings that fit, the longer one counts.
_ENDINGS = {
    **{name: name for name in ("s", "m", "mm", "kg", "Hz", "N", "J", "Pa")},
    **{"m2": "m^2", "m3": "m^3", "deg": "degree", "m_s": "m/s", "rad_s": "rad/s"},
    **{"N_s_m": "N s/m"},
}


def unit_of(name: str) -> str:
    """Read the unit off the name of a column, "1" where it has none."""
    return _ENDINGS.get(_ending(name), "1")


def without_unit(name: str) -> str:
    """The name of a column without the unit at its end: "time_s" -> "time"."""
    return name.removesuffix(f"_{_ending(name)}")


def _ending(name):
    """The longest of the endings that a name has before what numbers its column, or ""."""
    stem = re.sub(r"(_(N|place|box|seed)\d+)+$", "", name)
    return max((e for e in _ENDINGS if stem.endswith(f"_{e}")), key=len, default="")


def data_frame(columns: Mapping[str, ArrayLike], **attributes: Any) -> Any:
    """A pandas.DataFrame of columns of one length; ``attrs["units"]`` has the unit of each."""
    import pandas

    frame = pandas.DataFrame(dict(columns))
    frame.attrs = {"units": {name: unit_of(name) for name in columns}, **attributes}
    return frame


def arrays_of(table: Any) -> dict[str, np.ndarray]:
    """Columns of a pandas.DataFrame as arrays by name."""
    return {name: column.to_numpy() for name, column in table.items()}


class Tabulated:
    """Base of results that are a table, a row a scene or a sample."""

    @abstractmethod
    def columns(self) -> dict[str, Any]:
        """Columns of one length by name, which ends in the unit."""

    def table(self) -> Any:
        """Give all rows as a pandas.DataFrame, with units by column in ``attrs["units"]``."""
        return data_frame(self.columns())

    def write_csv(self, path: FileName) -> None:
        """Write the table as CSV.

        Parameters
        ----------
        path : path
            CSV file; it is replaced as a whole.
        """
        write_csv(path, self.columns())


def locked(values: ArrayLike) -> np.ndarray:
    """A view of an array that refuses to be written."""
    view = np.asarray(values).view()
    view.flags.writeable = False
    return view


def dataset(
    variables: Mapping[str, tuple[tuple[str, ...], ArrayLike, str]],
    axes: Mapping[str, tuple[ArrayLike, str]],
    **attributes: Any,
) -> Any:
    """Make an xarray.Dataset whose variables and coordinates carry their units."""
    import xarray

    return xarray.Dataset(
        {name: (dims, values, {"units": u}) for name, (dims, values, u) in variables.items()},
        {name: ((name,), np.asarray(v), {"units": u}) for name, (v, u) in axes.items()},
        attributes,
    )
