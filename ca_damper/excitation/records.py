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

#: Units of a time: seconds in 1 of each.
_TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3}
#: Units of a motion or force, spelled without signs: what a column of it holds, and SI units in 1.
UNITS = {
    **{unit: ("value", size) for unit, size in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3))},
    **{unit: ("value", size) for unit, size in (("um", 1e-6), ("N", 1.0), ("kN", 1e3))},
    **{unit: ("velocity", size) for unit, size in (("m_s", 1.0), ("cm_s", 1e-2), ("mm_s", 1e-3))},
    **{"m_s2": ("acceleration", 1.0), "cm_s2": ("acceleration", 1e-2)},
    **{"mm_s2": ("acceleration", 1e-3), "gal": ("acceleration", 1e-2)},
    "g": ("acceleration", 9.80665),
}
#: Name and unit of a header.
_HEADER = re.compile(r"[a-zA-Z]+[\s_]*[(\[]?\s*([^)\]]*?)\s*[)\]]?")
#: Number of samples and step in the fourth line of an AT2 file, of the newer and older form.
_AT2 = re.compile(r"(\d+)[^\d.]+(\d*\.?\d+(?:[eE][+-]?\d+)?)")


def from_csv(
    path: FileName,
    column: str | None = None,
    *,
    unit: str | None = None,
    correct_baseline: bool = False,
) -> Signal:
    """Signal from a file of columns, such as a measured motion of a base.

    Columns are separated by tabs, semicolons or commas; with the first two, decimals may have a
    comma. The first line that is not empty and does not begin with "#" names them, such as time_s,
    "Time [ms]", displacement_mm, "Vel (cm/s)" or "Acc (g)"; times without a unit are seconds.

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
    """
    name = path_name("path", path)
    table = _table(name)
    units = {one: _unit_of(one) for one in table.columns}
    times = [one for one, unit in units.items() if unit in _TIMES or _is_time(one)]
    others = [one for one in units if one not in times]
    motions = [one for one in others if units[one] in UNITS] or others
    if column is not None:
        motions = [choice("column", column, others)]
    if len(times) != 1 or len(motions) != 1:
        raise InputError(
            f"column must say which one is meant where {name} has not one time and one motion or "
            f"force, such as time_s and acceleration_g, got {shown(column)} and "
            f"{shown(list(table.columns))}"
        )
    wanted, (time,) = motions[0], times
    what, factor = _factor(f"column {wanted} of {name}", units[wanted], unit)
    seconds = _TIMES.get(units[time], 1.0) * _numbers(name, f"column {time}", table[time])
    values = factor * _numbers(name, f"column {wanted}", table[wanted])
    return _signal(name, wanted, seconds, values, what, correct_baseline)


def from_at2(path: FileName, *, correct_baseline: bool = False) -> Signal:
    """Signal from a record of the PEER ground motion database, an acceleration in g.

    Parameters
    ----------
    path : path
        AT2 file: four lines of head, of which the last has the number of samples and the step.
    correct_baseline : bool, default False
        As in ``from_csv``.
    """
    name = path_name("path", path)
    try:
        lines = Path(name).read_text(encoding="latin-1").splitlines()
    except OSError as error:
        raise InputError(f"{name} must be a file that can be read: {error.strerror}") from None
    match = _AT2.search(lines[3]) if len(lines) > 3 else None
    if match is None or "g" not in lines[2].lower().split("units of")[-1]:
        raise InputError(
            f"{name} must have accelerations in units of g and NPTS and DT in its third and fourth "
            f"line, got {shown(lines[2:4])}"
        )
    count, step = int(match[1]), float(match[2])
    cells = " ".join(lines[4:]).split()
    if len(cells) != count:
        raise InputError(f"{name} must hold {count} samples, as it says, got {len(cells)}")
    values = UNITS["g"][1] * _numbers(name, "accelerations", cells)
    time = step * np.arange(count)
    return _signal(name, "record", time, values, "acceleration", correct_baseline)


def _signal(name, column, time, values, what, correct_baseline):
    """Signal of a quantity; InputError with the name of its file."""
    try:
        made = from_samples(time, values, of=what, correct_baseline=correct_baseline)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return replace(made, label=f"{column} of {name}")


def _table(name: str) -> Any:
    """Columns of a file as a DataFrame of words by their names, decimal commas as points."""
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
    if between != ",":
        found = found.apply(lambda cells: cells.str.replace(",", "."))
    return found.rename(columns=str.strip)


def _unit_of(header: str) -> str:
    """Unit that a header names, "" for none."""
    match = _HEADER.fullmatch(header)
    return _spelled(match[1]) if match else ""


def _is_time(header: str) -> bool:
    """Whether a column without a unit is a time."""
    return header.lower() in ("t", "time")


def _spelled(unit: str) -> str:
    """A unit as UNITS spells it: "m/s^2", "m/s²" and "m_s2" are one."""
    plain = unit.replace("²", "2").replace("^", "").replace("µ", "u").replace("/", "_")
    return plain if plain == "N" or plain == "kN" else plain.lower().replace("_s_s", "_s2")


def _factor(where: str, own: str, given: str | None) -> tuple[str, float]:
    """What a column holds, and SI units in 1 of it; InputError where nothing names its unit."""
    if given is not None:
        given = choice("unit", _spelled(given) if isinstance(given, str) else given, UNITS)
    own = own if own in UNITS else ""
    if own and given and given != own:
        raise InputError(f"unit must be None or {own!r} for {where}, got {given!r}")
    if not (own or given):
        raise InputError(
            f"unit must be one of {', '.join(UNITS)} for {where}, whose name has none, got None"
        )
    return UNITS[own or str(given)]


def _numbers(name, where, cells):
    """Cells as numbers; InputError that names the first that is none."""
    try:
        found = np.asarray(cells, object).astype(np.float64)
    except ValueError as error:
        raise InputError(f"{name} must hold numbers in {where}: {error}") from None
    bad = np.flatnonzero(~np.isfinite(found))
    if len(bad):
        raise InputError(
            f"{name} must hold a finite number in {where} of row {bad[0] + 1}, "
            f"got {shown(np.asarray(cells, object)[bad[0]])}"
        )
    return found
