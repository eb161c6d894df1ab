"""The table that a sweep returns: results apart from what tells where they come from."""

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.sweeps.job import Job, Record
from taichi_dem.kit.sweeps.rows import SEED
from taichi_dem.kit.validation import FileName

#: Columns of the provenance that stand in a record.
_OF_RECORDS = ("version", "commit", "machine", "seconds")


class SweepTable(dict[str, np.ndarray]):
    """Result of ``sweep``: column name -> array, a row for each row of the input, in its order.

    Columns are those of the input, the results, NaN or "" where a row has none, and ``error``: the
    sentence of a row that failed, else "". They are the same bits wherever a job ran.

    Parameters
    ----------
    jobs : sequence of Job
        One a row, in the order of the input.
    records : sequence of Record
        What running them left.
    seeded : bool
        Whether the input has a column of seeds.
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
        jobs: Sequence[Job],
        records: Sequence[Record],
        seeded: bool,
        unseen: Sequence[str] = (),
    ):
        given = [name for name in jobs[0].row if name != SEED or seeded]
        results = dict.fromkeys(name for record in records for name in record.values)
        columns = {name: _column([job.row[name] for job in jobs]) for name in given}
        for name in results:
            columns[name] = _column([record.values.get(name) for record in records])
        columns["error"] = np.array([record.error for record in records], dtype=str)
        super().__init__(columns)
        self.unseen = tuple(unseen)
        self.provenance = {SEED: _column([job.row[SEED] for job in jobs])}
        for name in _OF_RECORDS:
            self.provenance[name] = _column([getattr(record, name) for record in records])

    def __repr__(self):
        failures = int((self["error"] != "").sum())
        rows = counted(len(self["error"]), "row"), counted(len(self), "column")
        return in_brief(self, *rows, f"{failures} failed" if failures else "", ", ".join(self))

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
    """Values as an array: of text where one is text, of floats where one is a float or missing."""
    there = [value for value in values if value is not None]
    if any(isinstance(value, str) for value in there):
        return np.array(["" if value is None else str(value) for value in values], dtype=str)
    for kind in (bool, int):
        if len(there) == len(values) and all(type(value) is kind for value in values):
            return np.array(values, dtype=kind if kind is bool else np.int64)
    return np.array([np.nan if value is None else float(value) for value in values])
