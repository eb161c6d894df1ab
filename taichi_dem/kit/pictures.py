"""Pictures of objects that do not know how they are drawn: drawing lies in layers above them."""

from collections.abc import Callable
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import renamed_when_done
from taichi_dem.kit.validation import FileName, path_name

_DRAWN_BY: dict[type, Callable[[Any], bytes]] = {}


def drawn_by(kind: type, function: Callable[[Any], bytes]) -> None:
    """Let a function draw objects of a class: it returns a PNG."""
    _DRAWN_BY[kind] = function


def png(thing: Any) -> bytes:
    """The picture of an object as PNG."""
    return _DRAWN_BY[type(thing)](thing)


def write_picture(thing: Any, path: FileName) -> None:
    """Write the picture of an object as a PNG file, whole or not at all; InputError."""
    name = path_name("path", path)
    if not name.lower().endswith(".png"):
        raise InputError(f"path must end in .png, got {name}")
    with renamed_when_done(name) as temporary:
        with open(temporary, "wb") as file:
            file.write(png(thing))
