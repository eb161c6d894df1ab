"""The table of a sweep: rows that go in, checked before any run."""

import itertools
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, path_name, shown

#: A value of a table.
Value = bool | int | float | str
#: A row by column name.
Row = dict[str, Value]
#: What a sweep takes for a table.
TableLike = Iterable[Mapping[str, Any]] | Mapping[str, Sequence] | FileName
#: Names of columns that a sweep adds to its result.
ADDED = ("error", "version", "commit", "machine", "seconds")


def parameter_grid(**columns: Iterable) -> list[Row]:
    """Rows of all combinations of some values, for ``sweep``.

    Parameters
    ----------
    **columns : iterable
        Values of each column; the last column varies fastest.

    Examples
    --------
    >>> parameter_grid(peak=[1.0, 2.0], rise=[3.0])
    [{'peak': 1.0, 'rise': 3.0}, {'peak': 2.0, 'rise': 3.0}]
    """
    for name, values in columns.items():
        if isinstance(values, str) or not isinstance(values, Iterable):
            raise InputError(f"column {name} must be a list of values, got {shown(values)}")
    return [dict(zip(columns, values)) for values in itertools.product(*columns.values())]


def checked_rows(table: TableLike) -> list[Row]:
    """Rows of a table, all with the same columns, values as Python has them. Raises InputError."""
    rows = _rows(table)
    if not rows or not rows[0]:
        raise InputError("a table must have at least one row and one column, got none")
    for name in rows[0]:
        if not isinstance(name, str) or not name or name in ADDED:
            raise InputError(
                f"a column of a table must have a name other than {', '.join(ADDED)}, "
                f"got {shown(name)}"
            )
    return [
        {name: plain_value(f"{name} of row {k}", value) for name, value in row.items()}
        for k, row in enumerate(rows)
    ]


def plain_value(name: str, value: object) -> Value:
    """A number or text as Python has it; InputError, which calls it by name, for anything else."""
    # A duration or date would become a number without its unit.
    if isinstance(value, np.generic) and value.dtype.kind in "biufU":
        value = value.item()
    if not isinstance(value, (bool, int, float, str)) or value == "" or value != value:
        raise InputError(f"{name} must be a number or text, got {shown(value)}")
    return value


def _rows(table):
    import pandas

    try:
        if not isinstance(table, (str, os.PathLike)):
            return pandas.DataFrame(table).to_dict("records")
    except (TypeError, ValueError):
        raise InputError(
            f"a table must be rows, columns or the name of a CSV file, got {shown(table)}"
        ) from None
    name, options = path_name("table", table), {"keep_default_na": False, "skipinitialspace": True}
    try:
        # As a row of text: pandas renames a column that is named twice.
        header = pandas.read_csv(name, header=None, dtype=str, **options).iloc[0]
        rows = pandas.read_csv(name, index_col=False, **options)
    except (OSError, ValueError) as error:
        raise InputError(f"table {name} cannot be read: {error}") from None
    if header.duplicated().any() or "" in [*header] or rows.empty:
        raise InputError(f"table {name} must have a header that names each column once, and rows")
    return rows.to_dict("records")
