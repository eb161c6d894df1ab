"""Records of motions as engineers have them: CSV files of many makes, and AT2 files of PEER."""

import csv
import io
import math
import re
from collections.abc import Iterable
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any, NamedTuple
from unicodedata import normalize

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
    **{"g": ("acceleration", 9.80665), "mg": ("acceleration", 9.80665e-3)},
}
#: Number of samples and step in the fourth line of an AT2 file, of the newer and older form.
_AT2 = re.compile(r"(\d+)[^\d.]+(\d*\.?\d+(?:[eE][+-]?\d+)?)")


class _Column(NamedTuple):
    """Column of a file: unit, "" for none, and cells as words."""

    unit: str
    cells: Any


def from_csv(
    path: FileName,
    column: str | None = None,
    *,
    unit: str | None = None,
    correct_baseline: bool = False,
    highpass: float | None = None,
    resample: float | None = None,
) -> Signal:
    """Signal from a file of columns, such as a measured motion of a base.

    Columns are separated by tabs, semicolons, commas or spaces; decimals may have a comma. The last
    line above the numbers names them, such as ``time_s,ax`` or ``Time [ms];Acceleration X (g)``;
    below it may be a line of units, above it anything. The time is the column whose name says so,
    in seconds without a unit, or else the first one.

    Parameters
    ----------
    path : path
        File.
    column : str, optional
        Name of the column to take; needed where there are several that hold a motion or a force.
    unit : str, optional
        Unit of that column, as in ``"g"`` or ``"m/s^2"``, whatever the file says.
    correct_baseline : bool, default False
        For an acceleration: subtract a straight line so that the motion ends at rest where it
        began, as in ``from_samples``; right for a record with an offset, wrong for a shock.
    highpass : float, optional
        Frequency below which the record is drift [Hz], as in ``from_samples``.
    resample : float, optional
        Step of even times for a record with gaps or uneven ones [s], as in ``from_samples``.
    """
    name = path_name("path", path)
    table = _table(name)
    named = [one for one in table if table[one].unit in _TIMES or one.lower() in ("t", "time")]
    time = (named or list(table))[0]
    wanted = _motion(name, [one for one in table if one not in (time, *named)], table, column)
    what, factor = _factor(f"column {wanted} of {name}", table[wanted].unit, unit)
    seconds = _TIMES.get(table[time].unit, 1.0) * _numbers(name, time, table[time].cells)
    values = factor * _numbers(name, wanted, table[wanted].cells)
    options = {"correct_baseline": correct_baseline, "highpass": highpass, "resample": resample}
    made = _signal(name, wanted, seconds, values, of=what, **options)
    if named:
        return made
    return replace(made, treated=f"time [s] by the first column, {time}; {made.treated}")


def from_at2(
    path: FileName, *, correct_baseline: bool = False, highpass: float | None = None
) -> Signal:
    """Signal from a record of the PEER ground motion database, an acceleration in g.

    Parameters
    ----------
    path : path
        AT2 file: four lines of head, of which the last has the number of samples and the step.
    correct_baseline : bool, default False
        As in ``from_csv``.
    highpass : float, optional
        As in ``from_csv``.
    """
    name = path_name("path", path)
    lines = _text(name).splitlines()
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
    options = {"correct_baseline": correct_baseline, "highpass": highpass}
    return _signal(name, "record", step * np.arange(count), values, of="acceleration", **options)


def _signal(name, column, time, values, **options):
    """Signal of samples; InputError with the name of their file."""
    try:
        made = from_samples(time, values, **options)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return replace(made, label=f"{column} of {name}")


def _text(name: str) -> str:
    try:
        found = Path(name).read_bytes()
    except OSError as error:
        raise InputError(f"{name} must be a file that can be read: {error.strerror}") from None
    try:
        return found.decode("utf-8-sig")
    except UnicodeDecodeError:
        return found.decode("latin-1")


def _table(name: str) -> dict[str, _Column]:
    """Columns of a file by their names."""
    import pandas

    lines = [line for line in _text(name).splitlines() if line.strip()]
    between = next((one for one in "\t;," if one in "".join(lines[-1:])), " ")
    try:
        rows = csv.reader(lines, delimiter=between, skipinitialspace=True)
        above = list(takewhile(lambda row: len(row) < 2 or math.isnan(_number(row[0])), rows))
        cells = pandas.read_csv(
            io.StringIO("\n".join(lines[len(above) :])),
            sep=between,
            header=None,
            dtype=str,
            keep_default_na=False,
            skipinitialspace=True,
            comment="#",
        )
    except (csv.Error, ValueError) as error:
        raise InputError(
            f"{name} must be a file of columns, with two numbers or more in a line: {error}"
        ) from None
    names, units = _heads(above, cells.shape[1])
    return {
        name: _Column(_unit_of(unit or name), cells[k])
        for k, (name, unit) in enumerate(zip(names, units))
    }


def _heads(above: list[list[str]], count: int) -> tuple[list[str], list[str]]:
    """Names of so many columns, each another, and units in a line of their own, of lines above."""
    fits = [row for row in above if len(row) == count]
    # A remark may stand between the names and the numbers, and may hold the names.
    fits = [row for row in fits if row[0][:1] != "#"] or fits
    is_units = len(fits) > 1 and all(_spelled(cell) in (*UNITS, *_TIMES, "") for cell in fits[-1])
    units = fits.pop() if is_units else [""] * count
    names: list[str] = []
    for k, cell in enumerate(fits[-1] if fits else units):
        own = cell.strip("# ") or f"column {k + 1}"
        names.append(f"{own} {k + 1}" if own in names else own)
    return names, units


def _motion(name: str, others: list[str], table: Any, column: Any) -> str:
    """The column that is meant, or the only one with the unit of a motion or force, or at all."""
    if column is not None:
        return choice("column", column, others)
    fits = [one for one in others if table[one].unit] or others
    if len(fits) != 1:
        raise InputError(
            f"column must say which one is meant where {name} has not one motion or force beside "
            f"a time, got None and {shown(list(table))}"
        )
    return fits[0]


def _spelled(text: str) -> str:
    """A header in small letters, units as in UNITS: "m/s^2", "m/s²" and "m s-2" are one."""
    plain = re.sub(r"[\^*]", "", normalize("NFKC", text)).replace("μ", "u")
    plain = re.sub(r"\W+", "_", re.sub("[-−]2", "2", plain)).strip("_").replace("_s_s", "_s2")
    return plain if plain.split("_")[-1] in ("N", "kN") else plain.lower()


def _unit_of(header: str) -> str:
    """The longest unit in which a header ends, "" for none."""
    spelled = f"_{_spelled(header)}"
    return max((u for u in (*UNITS, *_TIMES) if spelled.endswith(f"_{u}")), key=len, default="")


def _factor(where: str, own: str, given: str | None) -> tuple[str, float]:
    """What a column holds, and SI units in 1 of it; InputError where nothing names its unit."""
    if given is not None:
        own = choice("unit", _spelled(given) if isinstance(given, str) else given, UNITS)
    if not own:
        raise InputError(
            f"unit must be one of {', '.join(UNITS)} for {where}, whose name has none, got None"
        )
    return UNITS[own]


def _number(cell: Any) -> float:
    """A cell as a number, NaN where it is none; decimals may have a comma."""
    try:
        return float(str(cell).replace(",", "."))
    except ValueError:
        return math.nan


def _numbers(name: str, column: str, cells: Iterable[Any]) -> np.ndarray:
    """Cells as numbers; InputError that names the first that is none."""
    given = list(cells)
    found = np.array([_number(one) for one in given])
    bad = np.flatnonzero(~np.isfinite(found))
    if len(bad):
        raise InputError(
            f"{name} must hold a finite number in {column} of row {bad[0] + 1}, "
            f"got {shown(given[bad[0]])}"
        )
    return found
