"""Checks of what a user gives: the value comes back, or InputError names it and what is allowed."""

import math
import numbers

from taichi_dem.errors import InputError


def _finite(value):
    real = isinstance(value, numbers.Real) and not isinstance(value, bool)
    return real and math.isfinite(value)


def positive(name, value, zero_allowed=False):
    """The value as a float; InputError unless it is a finite number above (or at) zero."""
    if not _finite(value) or value < 0.0 or (value == 0.0 and not zero_allowed):
        limit = "zero or a positive" if zero_allowed else "a positive"
        raise InputError(f"{name} must be {limit} finite number, got {value!r}")
    return float(value)


def between(name, value, least, most):
    """The value as a float; InputError unless it is a number from least to most."""
    if not _finite(value) or not least <= value <= most:
        raise InputError(f"{name} must be a number from {least:g} to {most:g}, got {value!r}")
    return float(value)


def fraction(name, value):
    """The value as a float; InputError unless it lies in [0, 1]."""
    if not _finite(value) or not 0.0 <= value <= 1.0:
        raise InputError(f"{name} must lie in [0, 1], got {value!r}")
    return float(value)


def whole(name, value, least, most):
    """The value as an int; InputError unless it is a whole number from least to most."""
    integral = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not integral or not least <= value <= most:
        raise InputError(f"{name} must be a whole number from {least} to {most}, got {value!r}")
    return int(value)


def choice(name, value, allowed):
    """The value; InputError unless it is one of the words allowed."""
    if value not in tuple(allowed):
        raise InputError(f"{name} must be one of {', '.join(allowed)}, got {value!r}")
    return value


def several(name, values, check):
    """One value or a sequence as a tuple, each of them passed through check(name, value).

    InputError for an empty sequence, or for what check refuses.
    """
    if isinstance(values, (str, bytes)) or not hasattr(values, "__iter__"):
        values = (values,)
    checked = tuple(check(name, value) for value in values)
    if not checked:
        raise InputError(f"{name} must hold at least one value, got none")
    return checked


def direction(name, value):
    """Three finite numbers as a tuple of floats; InputError otherwise."""
    try:
        three = tuple(float(x) for x in value)
    except (TypeError, ValueError):
        three = ()
    if len(three) != 3 or not all(math.isfinite(x) for x in three):
        raise InputError(f"{name} must be three finite numbers, got {value!r}")
    return three
