"""The table of a sweep: rows from lists, columns, CSV files and products, checked before any run.

A row is a dict of column name to number or text.
"""

import csv
import itertools
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, is_whole, path_name, shown

#: A value of a table.
Value = bool | int | float | str
#: A row by column name.
Row = dict[str, Value]
#: What a sweep takes for a table.
TableLike = Sequence[Mapping[str, Any]] | Mapping[str, Sequence] | FileName
#: Column of the seeds of rows.
SEED = "seed"
#: Names of columns that a sweep adds to its result.
ADDED = ("error", "version", "commit", "machine", "seconds")
#: Whole numbers of a column lie within these, as NumPy has them.
_MOST_WHOLE = 2**63


def parameter_grid(**columns: Iterable) -> list[Row]:
    """Rows of all combinations of some values, for ``sweep``.

    Parameters
    ----------
    **columns : iterable
        Values of each column; the last column varies fastest.

    Returns
    -------
    list of dict
        One row for each combination, each value in the unit of its column.

    Raises
    ------
    InputError
        For no column at all, or a column that is not a list of values.

    Examples
    --------
    >>> parameter_grid(peak=[1.0, 2.0], rise=[3.0])
    [{'peak': 1.0, 'rise': 3.0}, {'peak': 2.0, 'rise': 3.0}]
    """
    if not columns:
        raise InputError("a parameter grid must have at least one column, got none")
    lists = [_values(name, values) for name, values in columns.items()]
    return [dict(zip(columns, combination)) for combination in itertools.product(*lists)]


def checked_rows(table: TableLike) -> list[Row]:
    """Rows of a table, each with the same columns and no empty cell, values as Python has them.

    Raises InputError in one sentence for anything else.
    """
    if isinstance(table, (str, os.PathLike)):
        rows = read_rows(table)
    elif hasattr(table, "columns") and hasattr(table, "to_dict"):
        rows = _of_columns(_columns_of_frame(table))
    elif isinstance(table, Mapping):
        rows = _of_columns(table)
    else:
        rows = _of_dicts(table)
    if not rows:
        raise InputError("a table must have at least one row, got none")
    for number, row in enumerate(rows):
        _check_columns(rows[0], row, number)
    return [
        {name: plain_value(f"{name} of row {k}", value) for name, value in row.items()}
        for k, row in enumerate(rows)
    ]


def read_rows(path: FileName, typed: bool = True) -> list[Row]:
    """Rows of a CSV file with a header; cells that read as numbers become numbers.

    typed: whether they do. Raises InputError for a file that cannot be read or is no such table.
    """
    name = path_name("table", path)
    try:
        with open(name, encoding="utf-8-sig", newline="") as file:
            cells = [line for line in csv.reader(file, strict=True) if line]
    except (OSError, UnicodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"table {name} cannot be read: {reason}") from None
    if len(cells) < 2:
        raise InputError(
            f"table {name} must have a header and at least one row, got {len(cells)} lines"
        )
    header = [cell.strip() for cell in cells[0]]
    _check_header(name, header)
    for number, line in enumerate(cells[1:]):
        if len(line) != len(header):
            raise InputError(
                f"row {number} of table {name} must have {len(header)} cells, got {len(line)}"
            )
        for column, cell in zip(header, line):
            if not cell.strip():
                raise InputError(f"row {number} of table {name} has an empty cell under {column!r}")
    return [
        {
            column: _number_or_text(cell.strip()) if typed else cell.strip()
            for column, cell in zip(header, line)
        }
        for line in cells[1:]
    ]


def plain_value(name: str, value: Any) -> Value:
    """A number or text as Python has it; InputError, which calls it by name, for anything else."""
    if isinstance(value, np.generic) and value.dtype.kind not in "mM":
        # A duration or date would become a number without its unit.
        value = value.item()
    if isinstance(value, bool):
        return value
    if isinstance(value, float):
        return float(value)
    if isinstance(value, str):
        return plain_text(name, value)
    if is_whole(value) and -_MOST_WHOLE <= int(value) < _MOST_WHOLE:
        return int(value)
    raise InputError(f"{name} must be a number or text, got {shown(value)}")


def plain_text(name: str, text: str) -> str:
    """Text that files and arrays hold as it is; InputError, which calls it by name, for other."""
    if "\0" in text or text.encode(errors="replace").decode() != text:
        raise InputError(f"{name} must be text without NUL that UTF-8 can hold, got {text[:40]!a}")
    return str(text)


def _values(name, values):
    if isinstance(values, (str, bytes, Mapping)) or not _has_items(values):
        raise InputError(f"column {name} must be a list of values, got {shown(values)}")
    return list(values)


def _has_items(values):
    """Whether values can be listed; arrays of no dimension say that they can, and cannot."""
    return hasattr(values, "__iter__") and getattr(values, "ndim", 1) > 0


def _columns_of_frame(frame):
    """Columns of a DataFrame, which may have several of one name; InputError where it has."""
    names = list(frame.columns)
    _check_once("a table", names)
    return {name: frame[name].to_list() for name in names}


def _of_columns(columns):
    lists = {name: _values(name, values) for name, values in columns.items()}
    lengths = {name: len(values) for name, values in lists.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"columns of a table must be equally long, got {shown(lengths)}")
    return [dict(zip(lists, values)) for values in zip(*lists.values())]


def _of_dicts(table):
    listed = _has_items(table) and not isinstance(table, (bytes, set, frozenset))
    rows = list(table) if listed else [table]
    for row in rows:
        if not isinstance(row, Mapping):
            raise InputError(
                f"a table must be rows, columns or the name of a CSV file, got {shown(table)}"
            )
    return [dict(row) for row in rows]


def _check_header(name, header):
    if "" in header:
        raise InputError(f"table {name} must name each column, got an empty name")
    _check_once(f"table {name}", header)


def _check_once(table, names):
    double = [name for k, name in enumerate(names) if name in names[:k]]
    if double:
        raise InputError(f"{table} must name each column once, got {double[0]!r} twice")


def _check_columns(first, row, number):
    """Refuse what a row lacks, or has beside the columns of the first row."""
    if not first:
        raise InputError("a table must have at least one column, got none")
    for name in row:
        if not isinstance(name, str) or not name or name in ADDED:
            raise InputError(
                f"a column of a table must have a name other than {', '.join(ADDED)}, "
                f"got {shown(name)}"
            )
        plain_text("the name of a column", name)
        if name not in first:
            raise InputError(f"row {number} has the unknown column {name!r}, which row 0 lacks")
    for name in first:
        if _is_empty(row.get(name)):
            raise InputError(f"row {number} has an empty cell under {name!r}")


def _is_empty(value):
    """Whether a cell holds nothing: no value, no text, NaN, or NA of pandas."""
    if value is None or isinstance(value, str):
        return not value
    try:
        return bool(value != value)
    except (TypeError, ValueError) as error:
        # NA is neither equal nor unequal; arrays are refused as values later.
        return isinstance(error, TypeError)


def _number_or_text(cell):
    # Python would read 2024_01 as 202401, and 1e400 as infinity.
    for kind in () if "_" in cell else (int, float):
        try:
            number = kind(cell)
        except ValueError:
            continue
        if number in (math.inf, -math.inf) and "inf" not in cell.lower():
            raise InputError(f"numbers of a table must be below 1.8e308 in size, got {cell}")
        return number
    return cell
