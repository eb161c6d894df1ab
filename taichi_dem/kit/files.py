"""Files that appear whole or not at all, and folders that can be written to."""

import contextlib
import csv
import functools
import hashlib
import os
import platform
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, path_name

#: Endings of what experiments write.
_WRITTEN = tuple(".checkpoint .csv .gif .html .json .msh .png .pvd .txt .vtu".split())
#: Name of a part: the process that writes it, and where such numbers name processes.
_PART = re.compile(r"\..+\.(\d+)-([0-9a-f]*)\.part(\.[^.]*)?")
#: Age at which a part whose process cannot be asked for is taken for dead [s].
_DEAD_S = 86_400.0
#: Letters with which a spreadsheet begins a formula, and their wide forms.
_FORMULA = tuple("=+-@\uff1d\uff0b\uff0d\uff20")


def output_folder(path: FileName) -> str:
    """Make a folder for output and return its path, with a leading "~" as the user's home."""
    path = path_name("output folder", path)
    try:
        os.makedirs(path, exist_ok=True)
        with tempfile.TemporaryFile(dir=path) as probe:
            probe.write(b"x")
            now = os.stat(probe.fileno()).st_mtime
        remove_dead_parts(path, now)
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
    temporary = os.path.join(folder, f".{root}.{os.getpid()}-{_here()}.part{ending}")
    try:
        yield temporary
        os.replace(temporary, path)
    except (OSError, UnicodeEncodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot write {path}: {reason}") from None
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)


def remove_dead_parts(folder: str, now: float) -> None:
    """Remove from a folder what killed processes have left of the files that they wrote."""
    # A part of another machine, or from before the last boot, is dead after a day unchanged.
    with contextlib.suppress(OSError), os.scandir(folder or os.curdir) as entries:
        for entry in entries:
            part = _PART.fullmatch(entry.name)
            with contextlib.suppress(OSError):
                if part and _is_dead(part[1], part[2], now - entry.stat().st_mtime):
                    os.remove(entry.path)


def _is_dead(number, place, age_s):
    if not place or place != _here():
        return age_s > _DEAD_S
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        # It is another user's.
        return False
    return False


@functools.cache
def _here() -> str:
    """Where a number means the same process: one boot of one machine, one container; or ""."""
    try:
        with open("/proc/sys/kernel/random/boot_id", encoding="utf-8") as file:
            words = file.read(), os.readlink("/proc/self/ns/pid"), platform.node()
    except OSError:
        return ""
    return hashlib.sha256(repr(words).encode()).hexdigest()[:8]


def remove_files(folder: FileName, pattern: str) -> None:
    """Remove files of a folder, if there is one, whose whole names match a regular expression."""
    for name in os.listdir(folder) if os.path.isdir(folder) else ():
        path = os.path.join(folder, name)
        if re.fullmatch(pattern, name) and os.path.isfile(path):
            try:
                os.remove(path)
            except OSError as error:
                reason = error.strerror or error
                raise InputError(f"cannot remove {path} of an earlier run: {reason}") from None


def older_files(folder: FileName, since: float) -> list[str]:
    """Names of files in a folder of a kind that programs write, unchanged since a time, sorted."""
    # Clocks of file systems may lag by two seconds.
    older = []
    with contextlib.suppress(OSError), os.scandir(os.fspath(folder)) as entries:
        for entry in entries:
            ours = entry.name.lower().endswith(_WRITTEN) and not entry.name.startswith(".")
            if ours and entry.is_file() and entry.stat().st_mtime < since - 2.0:
                older.append(entry.name)
    return sorted(older)


def write_whole(path: FileName, write: Callable[[str], object]) -> None:
    """Write a file through ``write(name)``, whole or not at all."""
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
    """Write columns of equal length, a dict of name to sequence, as a CSV file."""
    # A spreadsheet would compute text such as "=1+1": an apostrophe goes in front.
    arrays = map(np.asarray, columns.values())
    cells = (a.tolist() if a.dtype.kind in "biuf" else map(_as_text, a.tolist()) for a in arrays)
    with renamed_when_done(path) as temporary:
        with open(temporary, "w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(map(_as_text, columns))
            rows.writerows(zip(*cells))


def _as_text(cell):
    """A cell whose text is no formula; numbers stay, also those given as text."""
    if isinstance(cell, str) and cell.replace("\ufeff", "").lstrip().startswith(_FORMULA):
        try:
            float(cell)
        except ValueError:
            return f"'{cell}"
    return cell
