"""Checks of user input: they return the value, or raise InputError with the allowed range."""

import dataclasses
import decimal
import difflib
import math
import numbers
import os
from collections.abc import Callable, Collection, Iterable
from typing import Any, TypeVar

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length

#: Name of a file or folder.
FileName = str | os.PathLike
#: Result of the check of one value.
Checked = TypeVar("Checked")

#: Positive numbers lie between these, so that products of a few of them stay finite: beyond, one
#: overflows to infinity or falls to zero, and a run ends in NaN without a reason. In SI units
#: no real quantity comes near.
SMALLEST, LARGEST = 1e-60, 1e60
#: Value of an argument ``progress`` that asks for a bar on a terminal or in Jupyter.
AUTO = "auto"
#: Letters of a value that a sentence quotes.
_QUOTED = 80
# Digits by which any two numbers differ.
_MOST_DIGITS = 17


def shown(value: Any) -> str:
    """A value as a sentence quotes it: on one line, and cut where it is long."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:
        # Python prints no whole number of more than 4300 digits.
        text = f"a whole number of {value.bit_length()} bits"
    return text if len(text) <= _QUOTED else f"{text[: _QUOTED - 3]}..."


def told_apart(value: float, bound: float, digits: int = 3) -> tuple[str, str]:
    """A refused value and the bound that it misses, in the fewest digits that differ."""
    # The bound is rounded away from the value, so that it is allowed as it reads.
    given, limit = float(value), float(bound)
    side = decimal.ROUND_FLOOR if given > limit else decimal.ROUND_CEILING
    for count in range(digits, _MOST_DIGITS):
        rounding = decimal.Context(prec=count, rounding=side)
        inward = float(rounding.create_decimal(repr(limit)))
        if given == limit == inward or f"{given:.{count}g}" != f"{limit:.{count}g}":
            return f"{given:.{max(count, 6)}g}", f"{inward:.{count}g}"
    return repr(given), repr(limit)


def plain(value: Any) -> Any:
    """A number of any type as a Python int or float of the same value, tuples of them likewise."""
    # NumPy would calculate with np.float32 in 24 bits.
    if isinstance(value, tuple):
        return tuple(map(plain, value))
    if isinstance(value, (bool, int, float)) and type(value) in (bool, int, float):
        return value
    if is_whole(value):
        return int(value)
    return float(value) if finite(value) else value


def plain_fields(owner: Any) -> None:
    """Keep the numbers of a dataclass, also of a frozen one, as ``plain`` returns them."""
    for field in dataclasses.fields(owner):
        object.__setattr__(owner, field.name, plain(getattr(owner, field.name)))


def is_real(value: object) -> bool:
    """Whether a value is a real number: no truth value, and no duration, which has a unit."""
    # NumPy says of a duration that it is a whole number.
    return isinstance(value, numbers.Real) and not isinstance(value, (bool, np.timedelta64))


def is_whole(value: object) -> bool:
    """Whether a value is a whole number."""
    return isinstance(value, numbers.Integral) and is_real(value)


def finite(value: Any) -> bool:
    """Whether a value is a real number and finite as a float."""
    if not is_real(value):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def positive(name: str, value: Any, zero_allowed: bool = False) -> float:
    """The value as a float; InputError unless it is a finite number above (or at) zero."""
    # Between SMALLEST and LARGEST, products of a few numbers stay finite.
    if not finite(value) or value < 0.0 or (value == 0.0 and not zero_allowed):
        limit = "zero or a positive" if zero_allowed else "a positive"
        raise InputError(f"{name} must be {limit} finite number, got {shown(value)}")
    if value != 0.0 and not SMALLEST <= float(value) <= LARGEST:
        zero = "zero or " if zero_allowed else ""
        raise InputError(
            f"{name} must be {zero}a number from {SMALLEST:g} to {LARGEST:g}, got {shown(value)}"
        )
    return float(value)


def between(name: str, value: Any, least: float, most: float) -> float:
    """The value as a float; InputError unless it is a number from least to most."""
    if not finite(value) or not least <= float(value) <= most:
        low, high = f"{least:g}", f"{most:g}"
        if finite(value) and value < least:
            low = told_apart(value, least, 6)[1]
        elif finite(value):
            high = told_apart(value, most, 6)[1]
        raise InputError(f"{name} must be a number from {low} to {high}, got {shown(value)}")
    return float(value)


def fraction(name: str, value: Any) -> float:
    """The value as a float; InputError unless it lies in [0, 1]."""
    if not finite(value) or not 0.0 <= value <= 1.0:
        raise InputError(f"{name} must lie in [0, 1], got {shown(value)}")
    return float(value)


def whole(name: str, value: Any, least: int, most: int) -> int:
    """The value as an int; InputError unless it is a whole number from least to most."""
    if not is_whole(value) or not least <= value <= most:
        raise InputError(
            f"{name} must be a whole number from {least} to {most}, got {shown(value)}"
        )
    return int(value)


def flag(name: str, value: object) -> bool:
    """The value; InputError unless it is True or False."""
    if not isinstance(value, bool):
        raise InputError(f"{name} must be True or False, got {shown(value)}")
    return value


def choice(name: str, value: object, allowed: Collection[str]) -> str:
    """The value; InputError unless it is one of the words allowed."""
    if not isinstance(value, str) or value not in tuple(allowed):
        hint = did_you_mean(value, allowed)
        raise InputError(f"{name} must be one of {', '.join(allowed)}, got {shown(value)}{hint}")
    return value


def did_you_mean(value: object, allowed: Iterable[str]) -> str:
    """A question after a wrong word, where one of the words allowed is close to it."""
    close = difflib.get_close_matches(str(value), list(allowed), 1)
    return f": did you mean {close[0]}?" if close else ""


def word(name: str, value: object) -> str:
    """The value; InputError unless it is text that a mesh file can hold as a name."""
    if not isinstance(value, str) or not value or not value.isprintable() or '"' in value:
        raise InputError(
            f'{name} must be one line of text, of one letter at least and without ", '
            f"got {shown(value)}"
        )
    return value


def instance(name: str, value: object, kind: type | tuple[type, ...]) -> Any:
    """The value; InputError unless it is an object of a class, or of one of several."""
    kinds = kind if isinstance(kind, tuple) else (kind,)
    if not isinstance(value, kinds):
        names = " or ".join(allowed.__name__ for allowed in kinds)
        article = "an" if names[0] in "AEIOU" else "a"
        raise InputError(f"{name} must be {article} {names}, got {shown(value)}")
    return value


def progress_option(name: str, value: object) -> Any:
    """The value; InputError unless it is a function, "auto" (a bar where watched) or None."""
    if value is None or callable(value) or (isinstance(value, str) and value == AUTO):
        return value
    raise InputError(f'{name} must be a function, "{AUTO}" or None, got {shown(value)}')


def path_name(name: str, value: object) -> str:
    """The value as text, a leading "~" as the user's home; InputError unless it can name a file."""
    text = os.fspath(value) if isinstance(value, (str, os.PathLike)) else ""
    if not isinstance(text, str) or not text or "\0" in text:
        raise InputError(f"{name} must be the name of a file or folder, got {shown(value)}")
    # Python's own text: os.path cannot join np.str_, which is text and bytes at once.
    return os.path.expanduser(str.__str__(text))


def file_stem(name: str, value: object) -> str:
    """The value; InputError unless it is a name for files of one folder, without their ending."""
    text = str.__str__(value) if isinstance(value, str) else ""
    if not text.isprintable() or not text.strip() or text[0] == "." or {*text} & {*"/\\:"}:
        raise InputError(
            f"{name} must be a name for files of one folder, without /, \\, : and a leading dot, "
            f"got {shown(value)}"
        )
    return text


def several(name: str, values: Any, check: Callable[[str, Any], Checked]) -> tuple[Checked, ...]:
    """One value or a sequence as a tuple, each passed through check(name, value); not empty."""
    single = isinstance(values, (str, bytes, dict)) or not hasattr(values, "__iter__")
    if single or getattr(values, "ndim", 1) == 0:
        values = (values,)
    checked = tuple(check(name, value) for value in values)
    if not checked:
        raise InputError(f"{name} must hold at least one value, got none")
    return checked


def direction(name: str, value: Any) -> tuple[float, ...]:
    """Three finite numbers as a tuple of floats; InputError otherwise."""
    try:
        three = tuple(value)
    except TypeError:
        three = ()
    if len(three) != 3 or not all(finite(x) and abs(float(x)) <= LARGEST for x in three):
        raise InputError(
            f"{name} must be three finite numbers, none above {LARGEST:g}, got {shown(value)}"
        )
    return tuple(float(x) for x in three)


def unit_vector(name: str, value: object) -> np.ndarray:
    """The direction of three finite numbers, (3,), of length one; InputError where all are zero."""
    vector = np.array(direction(name, value))
    if not length(vector) > 0.0:
        raise InputError(f"{name} must be longer than zero, got {shown(value)}")
    return vector / length(vector)


def real_numbers(name: str, value: object, least: float = -LARGEST) -> np.ndarray:
    """A number or an array of any shape as floats; InputError unless all are from least to 1e60."""
    try:
        given = np.asarray(value)
    except ValueError:
        given = np.array(None)  # rows of different lengths
    if given.dtype.kind not in "iuf":
        raise InputError(f"{name} must be a number or an array of numbers, got {shown(value)}")
    with np.errstate(over="ignore"):
        numbers = given.astype(np.float64)
    bad = numbers[~((numbers >= least) & (numbers <= LARGEST))]
    if bad.size:
        kind = "finite" if least < 0.0 else "zero or positive" if least == 0.0 else "positive"
        raise InputError(
            f"{name} must be {kind} numbers from {least:g} to {LARGEST:g}, "
            f"got {shown(bad[0].item())}"
        )
    return numbers
