"""Classes whose objects are checked when they are made and cannot be changed afterwards."""

import inspect
from abc import ABCMeta
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown


class Sealing(ABCMeta):
    """Metaclass that seals an object once its outermost ``__init__`` has returned."""

    @property
    def __signature__(cls) -> inspect.Signature:
        """That of ``__init__``, without self, as for any class."""
        made: Any = cls
        if made.__init__ is object.__init__:
            return inspect.Signature()
        found = inspect.signature(made.__init__)
        return found.replace(parameters=list(found.parameters.values())[1:])

    def __call__(cls, *arguments: Any, **options: Any) -> Any:
        """Make an object; arrays among its attributes are copies that refuse to be written."""
        made = super().__call__(*arguments, **options)
        for name, value in vars(made).items():
            if isinstance(value, np.ndarray):
                vars(made)[name] = value.copy()
        _seal(made)
        return made


class Sealed(metaclass=Sealing):
    """Base of objects that are checked once; afterwards their attributes refuse to be set.

    Objects that are made without a call of their class, by ``object.__new__``, stay open.
    """

    # Beside the attributes, of which digests and representations are made.
    __slots__ = ("__dict__", "__weakref__", "_sealed")

    def __setstate__(self, state: Any) -> None:
        attributes, slots = state if isinstance(state, tuple) else (state, None)
        vars(self).update(attributes or {})
        if slots:
            _seal(self)

    def __setattr__(self, name: str, value: Any) -> None:
        _check_open(self, f"{name} = {shown(value)}")
        object.__setattr__(self, name, value)

    def __delattr__(self, name: str) -> None:
        _check_open(self, f"del {name}")
        object.__delattr__(self, name)


def _seal(thing):
    for value in vars(thing).values():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
    object.__setattr__(thing, "_sealed", True)


_mark: Any = vars(Sealed)["_sealed"]


def _check_open(thing, change):
    try:
        _mark.__get__(thing)
    except AttributeError:
        return
    kind = type(thing).__name__
    raise InputError(
        f"a {kind} must not be changed once it is made, as only then it is checked, got {change}: "
        f"make a new {kind}"
    )
