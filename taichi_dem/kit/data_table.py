"""Read-only tables of columns with units, for pandas, xarray and plain NumPy."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.display import counted
from taichi_dem.kit.display import table as html_table
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.optional import optional
from taichi_dem.kit.units import unit_of, without_unit
from taichi_dem.kit.validation import FileName, instance, shown, word

#: Rows that are shown at the top and at the bottom of a long table.
_SHOWN = 5
#: Letters of a printed line.
_LINE = 110


class Table(dict[str, np.ndarray]):
    """Columns by name: a dict that refuses changes and knows the unit of each column.

    Parameters
    ----------
    columns : mapping of str to array-like, shape (rows,)
        Kept as arrays that refuse to be written.
    units : mapping of str to str, optional
        Units of columns whose names do not say them (``taichi_dem.kit.units``).
    index : str
        Column that numbers the rows, such as ``"time_s"``; it names their dimension in xarray.

    Attributes
    ----------
    units : dict of str to str
        Unit by name of the column, ``"1"`` of pure numbers, ``""`` where it is not known.

    Raises
    ------
    InputError
        Columns are not of one shape (rows,), or a name is no text.

    Examples
    --------
    >>> table = Table({"time_s": [0.0, 1.0], "kinetic_J": [0.0, 2.5]}, index="time_s")
    >>> table["kinetic_J"].max(), table.units["kinetic_J"]
    (np.float64(2.5), 'J')
    """

    units: dict[str, str]
    index: str

    def __init__(
        self,
        columns: Mapping[str, ArrayLike],
        units: Mapping[str, str] | None = None,
        index: str = "row",
    ):
        instance("columns", columns, Mapping)
        instance("units", units, (Mapping, type(None)))
        super().__init__(
            {word("name of a column", name): locked(columns[name]) for name in columns}
        )
        shapes = {name: values.shape for name, values in self.items()}
        if len({*shapes.values()}) > 1 or any(len(shape) != 1 for shape in shapes.values()):
            raise InputError(f"columns must be of one shape, (rows,), got {shown(shapes)}")
        self.units = {name: (units or {}).get(name, unit_of(name)) for name in self}
        self.index = word("index", index)

    @property
    def row_count(self) -> int:
        """Number of rows."""
        return len(next(iter(self.values()), ()))

    def arrays(self) -> dict[str, np.ndarray]:
        """Copies of all columns, plain arrays by name, that may be written to.

        Returns
        -------
        dict of str to ndarray
            Copies, in the order of the columns.
        """
        return {name: values.copy() for name, values in self.items()}

    def to_pandas(self) -> Any:
        """A pandas DataFrame of all columns; its ``attrs["units"]`` holds their units.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        InputError
            Where pandas is not installed.
        """
        frame = optional("pandas").DataFrame(self.arrays())
        frame.attrs["units"] = dict(self.units)
        return frame

    def to_xarray(self) -> Any:
        """An xarray Dataset with one dimension, the rows; units in the attributes of variables.

        The dimension has the name of the column that numbers the rows, without its unit: "time".

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        InputError
            Where xarray is not installed.
        """
        rows = without_unit(self.index)
        columns = self.arrays()
        numbers = columns.pop(self.index, None)
        axes = {} if numbers is None else {rows: (numbers, self.units[self.index])}
        return dataset({n: ((rows,), v, self.units[n]) for n, v in columns.items()}, axes)

    def write_csv(self, path: FileName) -> None:
        """Write the table as CSV.

        Parameters
        ----------
        path : path
            Name of the file.

        Raises
        ------
        InputError
            When the file cannot be written.
        """
        write_csv(path, self)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {counted(self.row_count, 'row')}, {', '.join(self)}>"

    def __str__(self) -> str:
        cells = [[*self], [f"[{self.units[name]}]" for name in self], *self._rows()]
        widths = [max(len(row[k]) for row in cells) for k in range(len(self))]
        fitting = int((np.cumsum(widths) + 2 * np.arange(len(widths)) <= _LINE).sum())
        lines = ["  ".join(c.rjust(w) for c, w in zip(row, widths[:fitting])) for row in cells]
        also = f"; more columns: {', '.join([*self][fitting:])}" if fitting < len(self) else ""
        return "\n".join([*lines, f"({counted(self.row_count, 'row')}{also})"])

    def _repr_html_(self) -> str:
        heads = [f"{name} [{self.units[name]}]" for name in self]
        return html_table(self._rows(), heads)

    def _rows(self):
        """Cells of the rows that are shown, dots in the place of those between."""
        count = self.row_count
        short = count <= 2 * _SHOWN
        picked = range(count) if short else [*range(_SHOWN), *range(count - _SHOWN, count)]
        rows = [[_text(values[k]) for values in self.values()] for k in picked]
        return rows if short else [*rows[:_SHOWN], ["..."] * len(self), *rows[_SHOWN:]]

    def __reduce__(self):
        # A dict would be filled item by item, which this one refuses.
        return _restored, (type(self), dict(self), vars(self))

    def _refuse(self, *given: Any, **options: Any) -> Any:
        """Refuse the change.

        Parameters
        ----------
        *given : Any
            Arguments of the method of a dict.
        **options : Any
            Options of the method of a dict.

        Returns
        -------
        nothing

        Raises
        ------
        InputError
            In any case: tables are read-only.
        """
        raise InputError(
            f"a {type(self).__name__} must not be changed: take arrays(), or make a new one"
        )

    __setitem__ = __delitem__ = __ior__ = _refuse
    update = pop = popitem = clear = setdefault = _refuse


class Tabulated:
    """Base of results that ``table`` gives as rows: as a CSV file, and for pandas."""

    @abstractmethod
    def table(self) -> Table:
        """Give all rows as a table.

        Returns
        -------
        Table
            Columns by name, units in ``units``.
        """

    def to_pandas(self) -> Any:
        """Give the table as a pandas DataFrame.

        Returns
        -------
        pandas.DataFrame
            Units by column in its ``attrs``.

        Raises
        ------
        InputError
            Where pandas is not installed.
        """
        return self.table().to_pandas()

    def write_csv(self, path: FileName) -> None:
        """Write the table as CSV.

        Parameters
        ----------
        path : path
            CSV file; it is replaced as a whole.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        self.table().write_csv(path)


def _restored(kind, columns, attributes):
    """A table as it was before it was pickled."""
    made = kind.__new__(kind)
    Table.__init__(made, columns)
    vars(made).update(attributes)
    return made


def locked(values: ArrayLike) -> np.ndarray:
    """A view of an array that refuses to be written."""
    view = np.asarray(values).view()
    view.flags.writeable = False
    return view


def _text(value):
    return f"{value:.5g}" if isinstance(value, (float, np.floating)) else str(value)


def dataset(
    variables: Mapping[str, tuple[tuple[str, ...], ArrayLike, str]],
    axes: Mapping[str, tuple[ArrayLike, str]],
    **attributes: Any,
) -> Any:
    """Make an xarray Dataset whose variables and coordinates carry their units.

    Parameters
    ----------
    variables : mapping
        (dimensions, values, unit) by name.
    axes : mapping
        (values, unit) of the coordinate of each dimension that has one.
    **attributes
        Of the whole.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    InputError
        Where xarray is not installed.
    """
    xarray = optional("xarray")
    return xarray.Dataset(
        {name: (dims, values, {"units": u}) for name, (dims, values, u) in variables.items()},
        {name: ((name,), np.asarray(v), {"units": u}) for name, (v, u) in axes.items()},
        attributes,
    )
