"""Dependencies of the result of a function, as far as they show without running it.

Its bytecode, and what that names in files of the user: functions, classes, constants, values that
it closes over, defaults. Other packages count by their name and version. No digest depends on
addresses, on the order of a set or on whether a file is run or imported.
"""

import copyreg
import dis
import functools
import hashlib
import importlib.util
import os
import sys
import sysconfig
import types
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

_HOUSE = Path(__file__).resolve().parents[2]
#: Folders of Python and of both packages, and names of those of what is installed.
_LIBRARY = (
    *(Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib")),
    *(_HOUSE, _HOUSE.with_name("ca_damper")),
)
_INSTALLED = {"site-packages", "dist-packages"}
#: Names of a module or class that say where it stands, not what it does.
_PLACE = frozenset(
    "__name__ __file__ __spec__ __doc__ __module__ __qualname__ __dict__ __weakref__ "
    "__firstlineno__ __static_attributes__ __annotations__ __dataclass_params__ _abc_impl".split()
)
#: What imports or runs code, and what reads files, by names that may be computed.
_HIDDEN = frozenset("eval exec __import__ import_module run_path run_module".split())
_READS = frozenset(
    "open read_text read_bytes load loadtxt genfromtxt fromfile memmap read_csv listdir glob "
    "rglob iterdir scandir walk".split()
)
_PLAIN: Any = (str, bytes, int, float, complex, type(None), type(...))
_WRAPPERS = (staticmethod, classmethod, property, functools.cached_property)


class Dependencies:
    """What the results of a function, or a value, depend on.

    digest: of code and values. files: those named in them, digest of the content by path. unseen:
    sentences on what is not covered.
    """

    def __init__(self, work: Any):
        self.files: dict[str, str] = {}
        self.unseen: list[str] = []
        self._known: dict[int, str] = {}
        self._kept: list[Any] = []
        self.digest = self._digest(work, getattr(work, "__qualname__", "function"))

    def _digest(self, value: Any, name: str) -> str:
        """Digest of a value that goes by a name; of itself, where it is reached once more."""
        if isinstance(value, str):
            self.files.update(named_file(value, self.files))
        for kind in _PLAIN:
            if isinstance(value, kind):
                return _sha256(f"{type(value).__qualname__} {kind.__repr__(value)}".encode())
        if id(value) not in self._known:
            self._known[id(value)] = f"cycle {type(value).__qualname__}"
            self._kept.append(value)
            parts = " ".join([type(value).__qualname__, *self._parts(value, name)])
            self._known[id(value)] = _sha256(parts.encode())
        return self._known[id(value)]

    def _hidden(self, sentence):
        if sentence not in self.unseen:
            self.unseen.append(sentence)
        return sentence

    def _parts(self, value: Any, name: str) -> Iterator[str]:
        """Digests and words of which that of a value is made, in a fixed order."""
        if callable(value) and "__wrapped__" in getattr(value, "__dict__", ()):
            # What a decorator was given: functions of the user stand below those of libraries.
            yield self._digest(value.__wrapped__, name)
        if isinstance(value, types.CodeType):
            yield from self._of_code(value, name)
        elif isinstance(value, (types.FunctionType, type, types.ModuleType)) and _is_library(value):
            yield _library_name(value)
        elif isinstance(value, types.FunctionType):
            yield from self._of_function(value)
        elif isinstance(value, types.ModuleType):
            yield "module"  # what is taken from it counts: see _of_global
        elif isinstance(value, type):
            yield from (self._digest(kind, kind.__qualname__) for kind in value.__bases__)
            yield from self._of_items(vars(value).items(), value.__qualname__)
        elif isinstance(value, (set, frozenset)):
            yield from sorted(self._digest(one, name) for one in value)
        elif isinstance(value, (dict, types.MappingProxyType)):
            yield from self._of_items(value.items(), name)
        elif isinstance(value, (list, tuple)):
            yield from (self._digest(one, name) for one in value)
        elif isinstance(value, os.PathLike):
            yield self._digest(os.fspath(value), name)
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            yield f"{value.dtype} {value.shape} {_sha256(value.tobytes())}"
        elif isinstance(value, _WRAPPERS):
            for part in ("__func__", "func", "fget", "fset"):
                yield self._digest(getattr(value, part, None), name)
        else:
            yield from self._of_object(value, name)

    def _of_items(self, items: Iterable, name: str) -> Iterator[str]:
        for key, value in items:
            if not (isinstance(key, str) and key in _PLACE):
                yield self._digest(key, name)
                yield self._digest(value, f"{name}.{key}" if isinstance(key, str) else name)

    def _of_object(self, value, name):
        """An object by what would make it again; a method of C by its name."""
        try:
            registered = copyreg.dispatch_table.get(type(value))
            reduced = registered(value) if registered else value.__reduce_ex__(4)
        except Exception:
            unseen = f"the value of {name}, a {type(value).__qualname__}"
            yield getattr(value, "__qualname__", "") or self._hidden(unseen)
            return
        for part in (reduced,) if isinstance(reduced, str) else reduced:
            yield self._digest(list(part) if isinstance(part, Iterator) else part, name)

    def _of_function(self, function: types.FunctionType) -> Iterator[str]:
        name, code = function.__qualname__, function.__code__
        yield self._digest(code, name)
        yield self._digest(function.__defaults__, f"a default of {name}")
        yield self._digest(function.__kwdefaults__, f"a default of {name}")
        for free, cell in zip(code.co_freevars, function.__closure__ or ()):
            yield self._digest(cell.cell_contents, free)
        names = {*_names(code)} - _PLACE
        for one in sorted(names & function.__globals__.keys()):
            yield one
            yield from self._of_global(function.__globals__[one], one, names)

    def _of_global(self, value, name, names):
        """A value by its name; of a module of the user what a function takes from it."""
        yield self._digest(value, name)
        if isinstance(value, types.ModuleType) and not _is_library(value):
            for one in sorted(names & vars(value).keys() - _PLACE):
                yield one
                yield from self._of_global(vars(value)[one], f"{name}.{one}", names - {one})

    def _of_code(self, code: types.CodeType, name: str) -> Iterator[str]:
        yield _sha256(code.co_code + getattr(code, "co_exceptiontable", b""))
        yield repr((code.co_names, code.co_varnames, code.co_freevars, code.co_flags))
        for constant in code.co_consts:
            yield self._digest(constant, name)
            if isinstance(constant, str) and os.sep in constant and os.path.isdir(constant):
                self._hidden(f"files in the folder {constant}, which {name} names")
        for one in code.co_names:
            if one in _HIDDEN:
                self._hidden(f"what {name} runs or imports by {one}")
            if one in _READS:
                self._hidden(f"files whose names {name} computes, by {one}")
        for instruction in dis.get_instructions(code):
            if instruction.opname == "IMPORT_NAME":
                yield from self._of_import(instruction.argval, name)

    def _of_import(self, module, name):
        """A module that a function imports itself, by the text of its file."""
        try:
            path = getattr(importlib.util.find_spec(module), "origin", None)
        except (ImportError, ValueError):
            path = None
        if path is None or not _is_installed(path):
            yield digest_of_file(path) if path else ""
            self._hidden(f"what {name} imports when it is run, by way of {module or '.'}")


def named_file(text: str, known: dict[str, str]) -> dict[str, str]:
    """Path and digest of the file that a text names, {} where it names none; known: digests."""
    path = os.path.expanduser(text)
    try:
        return {path: known.get(path) or digest_of_file(path)} if os.path.isfile(path) else {}
    except (OSError, ValueError):
        return {}


def digest_of_file(path: str) -> str:
    """Digest of the content of a file. Raises OSError."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:24]


def _is_library(thing):
    """Whether a function, class or module stands in no file of the user."""
    code = getattr(thing, "__code__", None)
    if code is not None and os.path.isabs(code.co_filename):
        return _is_installed(code.co_filename)
    name = thing.__name__ if isinstance(thing, types.ModuleType) else thing.__module__
    if name == "__main__" or name not in sys.modules:
        return False
    path = getattr(sys.modules[name], "__file__", None)
    return path is None or _is_installed(path)


@functools.cache
def _is_installed(path):
    """Whether a file is none of the user's; modules of Python itself have none."""
    place = Path(path).resolve()
    is_within = any(place.is_relative_to(folder) for folder in _LIBRARY)
    return is_within or not place.is_file() or not _INSTALLED.isdisjoint(place.parts)


def _library_name(thing):
    """Name and version of a part of a library; that of a decorator, not of what it decorates."""
    module, name = getattr(thing, "__module__", ""), getattr(thing, "__qualname__", "")
    if isinstance(thing, types.ModuleType):
        module = thing.__name__
    elif isinstance(thing, types.FunctionType):
        module, name = thing.__globals__.get("__name__", ""), thing.__code__.co_name
    top = sys.modules.get(module.partition(".")[0])
    return f"{module} {name} {getattr(top, '__version__', '')}"


def _sha256(content):
    return hashlib.sha256(content).hexdigest()


def _names(code):
    """Names of globals and attributes in code and in the functions that stand within it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _names(constant)
