"""Records of motions as engineers have them: CSV files of many makes, and AT2 files of PEER."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ca_damper.excitation.samples import from_samples
from ca_damper.excitation.signal import Signal
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, choice, path_name, shown

#: SI units in 1 of the unit of each quantity that a column can hold, spelled without signs.
UNITS = {
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3},
    "displacement": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "velocity": {"m_s": 1.0, "cm_s": 1e-2, "mm_s": 1e-3},
    "acceleration": {
        **{"m_s2": 1.0, "cm_s2": 1e-2, "mm_s2": 1e-3},
        **{"g": 9.80665, "gal": 1e-2},
    },
    "force": {"N": 1.0, "kN": 1e3},
}
#: Beginnings of names by quantity, in small letters.
_NAMES = {
    "time": ("time", "t"),
    "displacement": ("displacement", "disp", "d"),
    "velocity": ("velocity", "vel", "v"),
    "acceleration": ("acceleration", "accel", "acc", "a"),
    "force": ("force", "f"),
}
#: What from_samples makes of a quantity.
_OF = {"displacement": "value", "force": "value"}
_HEADER = re.compile(r"([a-zA-Z]+)[\s_]*[(\[]?\s*([^)\]]*?)\s*[)\]]?")
#: Number of samples and step in the fourth line of an AT2 file, of the newer and older form.
_AT2 = (
    re.compile(r"NPTS\s*=\s*(\d+)\s*,\s*DT\s*=\s*([\d.eE+-]+)", re.IGNORECASE),
    re.compile(r"^\s*(\d+)\s+([\d.eE+-]+)"),
)


def from_csv(
    path: FileName,
    column: str | None = None,
    *,
    unit: str | None = None,
    correct_baseline: bool = False,
    resample: float | None = None,
) -> Signal:
    """Signal from a file of columns, such as a measured motion of a base.

    Columns are separated by tabs, semicolons or commas; with the first two, decimals may have a
    comma. The first line that is not empty and does not begin with "#" names them, such as time_s,
    "Time [ms]", displacement_mm, "Vel (cm/s)" or "Acc (g)"; without a unit a time counts in
    seconds.

    Parameters
    ----------
    path : path
        File.
    column : str, optional
        Name of the column to take; needed where there are several that hold a motion or a force.
    unit : str, optional
        Unit of that column, where its name has none, as in ``"g"`` or ``"m_s2"``.
    correct_baseline : bool, default False
        For an acceleration: subtract a straight line so that the motion ends at rest where it
        began, as in ``from_samples``; right for a record with an offset, wrong for a shock.
    resample : float, optional
        New step [s], as in ``from_samples``.

    Returns
    -------
    Signal
        Displacement [m] or force [N].

    Raises
    ------
    InputError
        The file cannot be read or names no unit; it holds text, empty cells, NaN, gaps or times
        that run backwards; or its step is too coarse for the spectrum of the motion.
    """
    name = path_name("path", path)
    table, comma = _table(name)
    known = {one: found for one in table.columns if (found := _quantity(one))}
    times = [one for one, (what, _) in known.items() if what == "time"]
    motions = {one: known[one] for one in known if one not in times}
    if column is not None:
        motions = {choice("column", column, motions): motions[column]}
    if len(times) != 1 or len(motions) != 1:
        raise InputError(
            f"column must say which one is meant where {name} has not one time and one motion or "
            f"force, such as time_s and acceleration_g, got {shown(column)} and "
            f"{shown(list(table.columns))}"
        )
    wanted, (what, own) = motions.popitem()
    factor = _factor(f"column {wanted} of {name}", what, own, unit)
    time = UNITS["time"][known[times[0]][1] or "s"] * _numbers(name, table, times[0], comma)
    values = factor * _numbers(name, table, wanted, comma)
    return _signal(name, wanted, time, values, what, correct_baseline, resample)


def from_at2(
    path: FileName, *, correct_baseline: bool = False, resample: float | None = None
) -> Signal:
    """Displacement [m] from a record of the PEER ground motion database, an acceleration in g.

    Parameters
    ----------
    path : path
        AT2 file: four lines of head, of which the last has the number of samples and the step.
    correct_baseline : bool, default False
        As in ``from_csv``.
    resample : float, optional
        As in ``from_samples``.
    """
    name = path_name("path", path)
    try:
        lines = Path(name).read_text(encoding="latin-1").splitlines()
    except OSError as error:
        raise InputError(f"{name} must be a file that can be read: {error.strerror}") from None
    head = lines[3] if len(lines) > 3 else ""
    match = next((found for one in _AT2 if (found := one.search(head))), None)
    if match is None or "g" not in lines[2].lower().split("units of")[-1]:
        raise InputError(
            f"{name} must have accelerations in units of g and NPTS and DT in its third and fourth "
            f"line, got {shown(lines[2:4])}"
        )
    count, step = int(match[1]), float(match[2])
    cells = " ".join(lines[4:]).split()
    if len(cells) != count:
        raise InputError(f"{name} must hold {count} samples, as it says, got {len(cells)}")
    values = UNITS["acceleration"]["g"] * _floats(name, "accelerations", cells)
    time = step * np.arange(count)
    return _signal(name, "record", time, values, "acceleration", correct_baseline, resample)


def _signal(name, column, time, values, what, correct_baseline, resample):
    """Signal of a quantity; InputError with the name of its file."""
    options = {"correct_baseline": correct_baseline, "resample": resample}
    try:
        made = from_samples(time, values, of=_OF.get(what, what), **options)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return replace(made, label=f"{column} of {name}")


def _table(name: str) -> tuple[Any, bool]:
    """Columns of a file as a DataFrame by their names, and whether decimals may have a comma."""
    import pandas

    layout: dict[str, Any] = {"comment": "#", "index_col": False, "dtype": str}
    try:
        text = Path(name).read_text(encoding="utf-8-sig")
        lines = (line for line in text.splitlines() if line.strip() and line[0] != "#")
        between = next((one for one in "\t;" if one in next(lines, "")), ",")
        found = pandas.read_csv(name, encoding="utf-8-sig", sep=between, **layout)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{name} must be a CSV file that can be read: {reason}") from None
    return found.rename(columns=str.strip), between != ","


def _quantity(header: str) -> tuple[str, str] | None:
    """Quantity and unit that a header names, "" for no unit; None for another header."""
    match = _HEADER.fullmatch(header)
    if match is None:
        return None
    word, unit = match[1].lower(), _spelled(match[2])
    what = next((one for one, names in _NAMES.items() if word in names), None)
    return None if what is None or (unit and unit not in UNITS[what]) else (what, unit)


def _spelled(unit: str) -> str:
    """A unit as UNITS spells it: "m/s^2", "m/s²" and "m_s2" are one."""
    plain = unit.replace("²", "2").replace("^", "").replace("µ", "u").replace("/", "_")
    return plain if plain == "N" or plain == "kN" else plain.lower().replace("_s_s", "_s2")


def _factor(where: str, what: str, own: str, given: str | None) -> float:
    """SI units in 1 of a column; InputError where neither header nor argument names the unit."""
    if given is not None:
        given = choice("unit", _spelled(given) if isinstance(given, str) else given, UNITS[what])
    if own and given and given != own:
        raise InputError(f"unit must be None or {own!r} for {where}, got {given!r}")
    if not (own or given):
        raise InputError(
            f"unit must be one of {', '.join(UNITS[what])} for {where}, whose name has none, got "
            "None"
        )
    return UNITS[what][own or str(given)]


def _numbers(name, table, column, comma):
    """Numbers of a column; InputError that names the row of the first cell that holds none."""
    cells = table[column].to_numpy(object)
    if comma:
        cells = [one.replace(",", ".") if isinstance(one, str) else one for one in cells]
    return _floats(name, f"column {column}", cells)


def _floats(name, where, cells):
    """Cells as numbers; InputError that names the first that is none."""
    try:
        found = np.array(cells, object).astype(np.float64)
    except ValueError as error:
        raise InputError(f"{name} must hold numbers in {where}: {error}") from None
    bad = np.flatnonzero(~np.isfinite(found))
    if len(bad):
        raise InputError(
            f"{name} must hold a finite number in {where} of row {bad[0] + 1}, "
            f"got {shown(cells[bad[0]])}"
        )
    return found
