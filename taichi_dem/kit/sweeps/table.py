"""The table of a sweep: rows that go in, checked before any run, and columns that come out.

A row is a dict of column name to number or text.
"""

import csv
import hashlib
import itertools
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.validation import FileName, path_name, shown

#: A value of a table.
Value = bool | int | float | str
#: A row by column name.
Row = dict[str, Value]
#: What a sweep takes for a table.
TableLike = Iterable[Mapping[str, Any]] | Mapping[str, Sequence] | FileName
#: Column of the seeds of rows.
SEED = "seed"
#: Names of columns that a sweep adds to its result.
ADDED = ("error", "version", "commit", "machine", "seconds")


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
        A column is not a list of values.

    Examples
    --------
    >>> parameter_grid(peak=[1.0, 2.0], rise=[3.0])
    [{'peak': 1.0, 'rise': 3.0}, {'peak': 2.0, 'rise': 3.0}]
    """
    lists = [_values(name, values) for name, values in columns.items()]
    return [dict(zip(columns, combination)) for combination in itertools.product(*lists)]


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
    for k, row in enumerate(rows):
        if row.keys() != rows[0].keys():
            wanted, got = shown([*rows[0]]), shown([*row])
            raise InputError(f"row {k} must have the columns of row 0, {wanted}, got {got}")
    return [
        {name: plain_value(f"{name} of row {k}", row[name]) for name in rows[0]}
        for k, row in enumerate(rows)
    ]


def _read_rows(path):
    """Rows of a CSV file with a header; cells that read as numbers become numbers."""
    name = path_name("table", path)
    try:
        with open(name, encoding="utf-8-sig", newline="") as file:
            lines = [[cell.strip() for cell in line] for line in csv.reader(file) if line]
    except (OSError, UnicodeError, csv.Error) as error:
        raise InputError(f"table {name} cannot be read: {error}") from None
    header, *cells = lines or [[]]
    if len({*header}) < len(header) or not cells:
        raise InputError(f"table {name} must have a header that names each column once, and rows")
    for k, line in enumerate(cells):
        if len(line) != len(header) or "" in line:
            raise InputError(f"row {k} of table {name} must have {len(header)} cells, none empty")
    return [{column: _number_or_text(cell) for column, cell in zip(header, line)} for line in cells]


def plain_value(name: str, value: Any) -> Value:
    """A number or text as Python has it; InputError, which calls it by name, for anything else."""
    # A duration or date would become a number without its unit.
    if isinstance(value, np.generic) and value.dtype.kind in "biufU":
        value = value.item()
    if not isinstance(value, (bool, int, float, str)) or value == "" or value != value:
        raise InputError(f"{name} must be a number or text, got {shown(value)}")
    return value


def _rows(table):
    if isinstance(table, (str, os.PathLike)):
        return _read_rows(table)
    if hasattr(table, "to_dict"):
        return table.to_dict("records")
    if isinstance(table, Mapping):
        return _rows_of_columns({name: _values(name, column) for name, column in table.items()})
    rows = list(table) if hasattr(table, "__iter__") else [table]
    if not all(isinstance(row, Mapping) for row in rows):
        raise InputError(
            f"a table must be rows, columns or the name of a CSV file, got {shown(table)}"
        )
    return rows


def _rows_of_columns(columns):
    lengths = {name: len(values) for name, values in columns.items()}
    if len({*lengths.values()}) > 1:
        raise InputError(f"columns of a table must be equally long, got {shown(lengths)}")
    return [dict(zip(columns, values)) for values in zip(*columns.values())]


def _values(name, values):
    if isinstance(values, str) or not hasattr(values, "__iter__"):
        raise InputError(f"column {name} must be a list of values, got {shown(values)}")
    return list(values)


def _number_or_text(cell):
    # Python would read 2024_01 as 202401.
    for kind in () if "_" in cell else (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell


class SweepTable(dict[str, np.ndarray]):
    """Result of ``sweep``: column name -> array, a row for each row of the input, in its order.

    Columns are those of the input, the results, NaN or "" where a row has none, and ``error``: the
    sentence of a row that failed, else "". They are the same bits wherever a row ran.

    Parameters
    ----------
    columns : mapping of str to list
        Values by column, None where a row has none.
    provenance : mapping of str to list
        Likewise, of the columns that say where results come from.
    unseen : sequence of str
        What the key of a row does not cover.

    Attributes
    ----------
    unseen : tuple of str
        What a change of would not run finished rows again, such as files of a computed name.
    provenance : dict of str to ndarray
        Seed of each row, version of the package, commit of its sources or "unknown", machine, and
        seconds on the wall [s].

    Examples
    --------
    >>> table = sweep(run, rows)                           # doctest: +SKIP
    >>> table["displacement_mm"].mean(), table.provenance["seconds"].sum()  # doctest: +SKIP
    """

    def __init__(
        self,
        columns: Mapping[str, Sequence],
        provenance: Mapping[str, Sequence],
        unseen: Sequence[str] = (),
    ):
        super().__init__({name: _column(values) for name, values in columns.items()})
        self.provenance = {name: _column(values) for name, values in provenance.items()}
        self.unseen = tuple(unseen)

    def __repr__(self):
        rows, failed = len(self["error"]), int((self["error"] != "").sum())
        return f"<SweepTable: {rows} rows, {failed} failed, columns {', '.join(self)}>"

    @property
    def digest(self) -> str:
        """Digest of all columns but the provenance: equal where tables agree bit for bit."""
        made = hashlib.sha256()
        for name, column in self.items():
            content = column.tobytes() if column.dtype.kind != "U" else repr(column.tolist())
            made.update(f"{name} {column.dtype.kind} {len(column)} ".encode())
            made.update(content if isinstance(content, bytes) else content.encode())
        return made.hexdigest()[:24]

    def to_pandas(self, provenance: bool = False) -> Any:
        """Return the table as a pandas.DataFrame.

        Parameters
        ----------
        provenance : bool
            Whether its columns stand behind the others.

        Returns
        -------
        pandas.DataFrame
        """
        return data_frame(self._with(provenance))

    def write_csv(self, path: FileName, provenance: bool = True) -> None:
        """Write the table as a CSV file.

        Parameters
        ----------
        path : path
            Name of the file.
        provenance : bool
            Whether its columns stand behind the others.

        Raises
        ------
        InputError
            When the file cannot be written.
        """
        write_csv(path, self._with(provenance))

    def _with(self, provenance):
        return {**self, **self.provenance} if provenance else {**self}


def _column(values):
    """Values as an array: of text where one is text, of floats where one is missing."""
    if any(isinstance(value, str) for value in values):
        return np.array(["" if value is None else str(value) for value in values])
    if None in values:
        return np.array([np.nan if value is None else float(value) for value in values])
    return np.array(values)
