"""Signals from CSV files with a line of column names, which say what a column is and its unit."""

import csv
import math
from dataclasses import replace

import numpy as np

from ca_damper.excitation.samples import from_samples
from ca_damper.excitation.signal import Signal
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, choice, flag, path_name, shown

#: Seconds in the unit of a column of times.
TIMES = {"time_s": 1.0, "time_ms": 1e-3}
#: Of each other column: what its values are of, and how much of the SI unit is 1.
COLUMNS = {
    "displacement_m": ("value", 1.0),
    "displacement_mm": ("value", 1e-3),
    "displacement_um": ("value", 1e-6),
    "acceleration_m_s2": ("acceleration", 1.0),
    "acceleration_mm_s2": ("acceleration", 1e-3),
    "acceleration_g": ("acceleration", 9.80665),
    "force_N": ("value", 1.0),
}


def from_csv(
    path: FileName, column: str | None = None, *, correct_baseline: bool = False
) -> Signal:
    """Signal from a CSV file, such as a measured motion of a base.

    The first line that is not empty and does not begin with "#" names the columns: time_s or
    time_ms, and what was measured: displacement_m, _mm or _um, acceleration_m_s2, _mm_s2 or _g, or
    force_N.

    Parameters
    ----------
    path : path
        CSV file.
    column : str, optional
        Column to take; needed where there are several of them.
    correct_baseline : bool, default False
        For an acceleration: subtract a straight line so that the motion ends at rest where it
        began, as in ``from_samples``; right for a record with an offset, wrong for a shock.

    Returns
    -------
    Signal
        Displacement [m] or force [N].

    Raises
    ------
    InputError
        The file cannot be read; it holds text, empty cells, NaN, gaps or times that run backwards;
        or its step is too coarse for the spectrum of the motion.
    """
    name = path_name("path", path)
    flag("correct_baseline", correct_baseline)
    rows = _rows(name)
    head = [cell.strip() for cell in rows[0][1]] if rows else []
    wanted = _wanted(name, head, column)
    times = [one for one in TIMES if one in head]
    if len(times) != 1:
        raise InputError(f"{name} must have one column of {' or '.join(TIMES)}, got {shown(head)}")
    time_s = TIMES[times[0]] * _numbers(name, rows, head, times[0])
    of, unit = COLUMNS[wanted]
    samples = unit * _numbers(name, rows, head, wanted)
    try:
        made = from_samples(time_s, samples, of=of, correct_baseline=correct_baseline)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return replace(made, label=f"{wanted} of {name}")


def _rows(name):
    """(number of the line, cells) of each line with something in it."""
    try:
        with open(name, newline="", encoding="utf-8-sig") as file:
            lines = enumerate(csv.reader(file), start=1)
            return [(k, row) for k, row in lines if any(map(str.strip, row)) and row[0][:1] != "#"]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{name} must be a CSV file that can be read: {reason}") from None


def _wanted(name, head, column):
    there = [one for one in head if one in COLUMNS]
    if column is not None:
        if choice("column", column, COLUMNS) not in there:
            raise InputError(f"{name} must have the column {column}, got {shown(head)}")
        return column
    if not there:
        raise InputError(f"{name} must have a column of {', '.join(COLUMNS)}, got {shown(head)}")
    if len(there) > 1:
        raise InputError(
            f"column must say which of {', '.join(there)} of {name} is meant, got None"
        )
    return there[0]


def _numbers(name, rows, head, column):
    """Numbers of a column; InputError that names the line of the first cell that holds none."""
    place = head.index(column)
    found = np.empty(len(rows) - 1)
    for k, (line, cells) in enumerate(rows[1:]):
        cell = cells[place].strip() if place < len(cells) else ""
        try:
            found[k] = float(cell)
        except ValueError:
            found[k] = math.nan
        if not math.isfinite(found[k]):
            raise InputError(
                f"{name} must hold a finite number in column {column} of line {line}, "
                f"got {shown(cell)}"
            )
    return found
