"""Files that appear whole or not at all, and folders that can be written to."""

import contextlib
import csv
import os
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, path_name

#: Endings of what experiments write.
_WRITTEN = tuple(".csv .gif .glb .html .json .msh .npz .png .pvd .txt .vtkhdf .vtu .xyz".split())


def output_folder(path: FileName) -> str:
    """Make a folder for output and return its path, with a leading "~" as the user's home.

    Raises InputError when it cannot be made or written to.
    """
    path = path_name("output folder", path)
    try:
        os.makedirs(path, exist_ok=True)
        with tempfile.TemporaryFile(dir=path) as probe:
            probe.write(b"x")
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"output folder {path} must be writable: {reason}") from None
    return path


@contextlib.contextmanager
def renamed_when_done(path: FileName) -> Iterator[str]:
    """A temporary name beside ``path`` that becomes ``path`` only after a complete write."""
    path = path_name("file", path)
    folder, name = os.path.split(path)
    root, ending = os.path.splitext(name)  # kept, since some writers derive the format from it
    temporary = os.path.join(folder, f".{root}.{os.getpid()}.part{ending}")
    try:
        yield temporary
        os.replace(temporary, path)
    except (OSError, UnicodeEncodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot write {path}: {reason}") from None
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)


def remove_files(folder: FileName, pattern: str) -> None:
    """Remove the files of a folder, if there is one, whose whole names match a regular expression.

    Raises InputError when one of them cannot be removed.
    """
    for name in os.listdir(folder) if os.path.isdir(folder) else ():
        path = os.path.join(folder, name)
        if re.fullmatch(pattern, name) and os.path.isfile(path):
            try:
                os.remove(path)
            except OSError as error:
                reason = error.strerror or error
                raise InputError(f"cannot remove {path} of an earlier run: {reason}") from None


def older_files(folder: FileName, since: float) -> list[str]:
    """Names of files in a folder of a kind that programs write, unchanged since a time, sorted.

    since: as of ``time.time``; clocks of file systems may lag behind by two seconds.
    """
    found = []
    with contextlib.suppress(OSError), os.scandir(os.fspath(folder)) as entries:
        for entry in entries:
            ours = entry.name.lower().endswith(_WRITTEN) and not entry.name.startswith(".")
            if ours and entry.is_file() and entry.stat().st_mtime < since - 2.0:
                found.append(entry.name)
    return sorted(found)


def write_whole(path: FileName, write: Callable[[str], object]) -> None:
    """Write a file through ``write(name)``, whole or not at all.

    Raises InputError when the file cannot be written.
    """
    with renamed_when_done(path) as temporary:
        write(temporary)


def write_text(path: FileName, text: str) -> None:
    """Write text as a file. Raises InputError when it cannot be written."""
    with renamed_when_done(path) as temporary:
        with open(temporary, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)


def write_bytes(path: FileName, content: bytes) -> None:
    """Write bytes as a file. Raises InputError when it cannot be written."""
    with renamed_when_done(path) as temporary:
        with open(temporary, "wb") as file:
            file.write(content)


def write_csv(path: FileName, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns of equal length, a dict of name to sequence, as a CSV file.

    Raises InputError when it cannot be written.
    """
    with renamed_when_done(path) as temporary:
        with open(temporary, "w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(zip(*(np.asarray(values).tolist() for values in columns.values())))
