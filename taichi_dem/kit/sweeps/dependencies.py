"""Files on which the result of a function depends: sources of the user, and what a text names."""

import contextlib
import hashlib
import os
import sys
import sysconfig
from collections.abc import Callable, Iterable
from modulefinder import ModuleFinder
from pathlib import Path
from typing import Any

#: Both packages count by their version.
HOUSE = ("taichi_dem", "ca_damper")
_LIBRARY = [Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib")]
_INSTALLED = {"site-packages", "dist-packages"}


def digest_of_sources(work: Callable[..., Any]) -> str:
    """Digest of the file of a function and of those of the user that it imports, at any depth.

    Imports of names that are computed do not count.
    """
    module = sys.modules[work.__module__]
    finder = ModuleFinder([*filter(_is_of_user, sys.path)], excludes=HOUSE)
    package = sys.modules.get((module.__package__ or "").partition(".")[0])
    # A module of a library is not found, and is its own file alone.
    with contextlib.suppress(ImportError):
        if getattr(package, "__file__", None) and module.__spec__ is not None:
            # By its name in its package, from which relative imports start.
            finder.import_hook(module.__spec__.name)
        else:
            finder.run_script(str(module.__file__))
    found = (getattr(one, "__file__", None) for one in finder.modules.values())
    return digest_of_files({str(module.__file__), *filter(None, found)})


def _is_of_user(folder):
    """Whether a folder of Python's path holds nothing that was installed."""
    place = Path(folder).resolve()
    is_library = any(place.is_relative_to(one) for one in _LIBRARY)
    return not is_library and _INSTALLED.isdisjoint(place.parts)


def named_file(text: str, known: dict[str, str]) -> dict[str, str]:
    """Path and digest of the file that a text names, {} where it names none; known: digests."""
    path = os.path.expanduser(text)
    try:
        return {path: known.get(path) or digest_of_file(path)} if os.path.isfile(path) else {}
    except (OSError, ValueError):
        return {}


def digest_of_files(paths: Iterable[Any]) -> str:
    """Digest of the contents of files, whatever their order. Raises OSError."""
    return hashlib.sha256(" ".join(sorted(map(digest_of_file, paths))).encode()).hexdigest()


def digest_of_file(path: str) -> str:
    """Digest of the content of a file. Raises OSError."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:24]
