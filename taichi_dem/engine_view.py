"""Views of the parts of an engine: the data of their simulation are loaded before each access."""

from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike
from taichi.lang import impl
from taichi.lang.matrix import MatrixField

from taichi_dem.kit.allocation import array_of, assign, values
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.engine_pool import Loan
from taichi_dem.kit.uncopied import Uncopied

_OWN = ("taichi_dem", "ca_damper")


class PartView(Uncopied):
    """A part of an engine on behalf of a simulation, which may share the engine with others.

    Attributes and methods are those of the part; before each access the simulation's data are
    brought to the device. Fields are returned as ``FieldView``. Kernels see the part itself.
    """

    def __init__(self, loan: Loan, path: tuple[str, ...]):
        self.__dict__.update(_loan=loan, _path=path)

    def _part(self):
        return _at(self._loan.engine, self._path)

    def __getattr__(self, name):
        if impl.inside_kernel():
            return getattr(self._part(), name)
        self._loan.activate()
        value = getattr(self._part(), name)
        if isinstance(value, ti.Field):
            return FieldView(self._loan, (*self._path, name))
        if name == "fields":
            return self._fields
        if _is_part(value):
            return PartView(self._loan, (*self._path, name))
        return value

    def __setattr__(self, name, value):
        setattr(self._part(), name, value)

    def _fields(self):
        """Fields of the part by name, as FieldViews."""
        found = self._part().fields()
        return {name: FieldView(self._loan, (field,)) for name, field in found.items()}

    def __repr__(self):
        return in_brief(self._part(), f"part of a {self._loan.what}")

    @property
    def name(self) -> str:
        """Name of the part; available also after its session has ended."""
        return self._part().name


class FieldView(Uncopied):
    """A field of an engine on behalf of a simulation: only the entries of its scene.

    As a NumPy array by ``to_numpy()``; single entries by index, as those of a field.
    """

    def __init__(self, loan: Loan, path: tuple[Any, ...]):
        self._loan, self._path = loan, path

    @property
    def field(self) -> ti.Field:
        """The field itself, with the data of the simulation in it."""
        self._loan.activate()
        if isinstance(self._path[0], ti.Field):
            return self._path[0]
        return _at(self._loan.engine, self._path)

    @property
    def shape(self) -> tuple:
        """Entries of the scene."""
        shape = self.field.shape
        lengths = self._loan.engine.lengths
        return (lengths.get(shape[0], shape[0]), *shape[1:]) if shape else shape

    def to_numpy(self) -> np.ndarray:
        """Copy of the entries."""
        found = values(self.field)
        return found[: self.shape[0]] if self.field.shape else found

    def from_numpy(self, array: ArrayLike) -> None:
        """Write the first entries."""
        assign(self.field, array)

    def fill(self, value: float) -> None:
        """Set all entries of the scene to a value."""
        whole = self.to_numpy()
        whole[...] = value
        assign(self.field, whole)

    def __repr__(self):
        return in_brief(self, ".".join(map(str, self._path)), f"field of a {self._loan.what}")

    def __getitem__(self, index):
        field = self.field
        if isinstance(field, MatrixField) or impl.current_cfg().arch == ti.cuda:
            return field[index]
        return array_of(field)[() if index is None else index].item()

    def __setitem__(self, index, value):
        self.field[index] = value

    def __getattr__(self, name):
        return getattr(self.field, name)


def _at(part, path):
    for name in path:
        part = part[name] if isinstance(part, dict) else getattr(part, name)
    return part


def _is_part(value) -> bool:
    return type(value).__module__.split(".")[0] in _OWN and hasattr(value, "__dict__")
