"""Files that appear whole or not at all, and folders that can be written to."""

import contextlib
import csv
import os
import re
from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, path_name, shown


def output_folder(path: FileName) -> str:
    """Make a folder for output and return its path, with a leading "~" as the user's home.

    Raises InputError when it cannot be made or written to.
    """
    name = os.fspath(path) if isinstance(path, (str, os.PathLike)) else ""
    if not isinstance(name, str) or not name or "\0" in name:
        raise InputError(f"output folder must be the name of a folder, got {shown(path)}")
    path = os.path.expanduser(name)
    try:
        os.makedirs(path, exist_ok=True)
        probe = os.path.join(path, ".write-test")
        with open(probe, "w") as handle:
            handle.write("x")
        os.remove(probe)
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"output folder {path} must be writable: {reason}") from None
    return path


@contextlib.contextmanager
def renamed_when_done(path: FileName) -> Iterator[str]:
    """A temporary name beside ``path`` that becomes ``path`` only after a complete write."""
    path = path_name("file", path)
    folder, name = os.path.split(path)
    if not os.path.isdir(folder or "."):
        raise InputError(f"cannot write {path}: there is no folder {folder}")
    root, ending = os.path.splitext(name)  # kept, since some writers derive the format from it
    temporary = os.path.join(folder, f".{root}.{os.getpid()}.part{ending}")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from None
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)


def remove_files(folder: FileName, pattern: str) -> None:
    """Remove the files of a folder, if there is one, whose whole names match a regular expression.

    Raises InputError when one of them cannot be removed.
    """
    if not os.path.isdir(folder):
        return
    for name in os.listdir(folder):
        path = os.path.join(folder, name)
        if re.fullmatch(pattern, name) and os.path.isfile(path):
            try:
                os.remove(path)
            except OSError as error:
                reason = error.strerror or error
                raise InputError(f"cannot remove {path} of an earlier run: {reason}") from None


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


def write_csv(path: FileName, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns of equal length, a dict of name to sequence, as a CSV file.

    Raises InputError when it cannot be written.
    """
    with renamed_when_done(path) as temporary:
        with open(temporary, "w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(zip(*(np.asarray(values).tolist() for values in columns.values())))
