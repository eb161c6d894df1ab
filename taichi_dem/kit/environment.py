"""Environment variables and folders that Taichi depends on, corrected when this is imported.

That must be before anything imports Taichi, which this module does for the first time.
Taichi reads a variable ``TI_NAME`` for each of its settings: some overrule the settings that keep
bits equal, others end the process where they are malformed. A kernel cache that it cannot write to
crashes it.
"""

import atexit
import contextlib
import importlib
import io
import mmap
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown

try:
    import resource
except ImportError:  # not on Windows
    resource = None  # type: ignore[assignment]

#: What a user may choose; all other variables of Taichi are removed.
_CACHE, _CACHE_FOLDER = "TI_OFFLINE_CACHE", "TI_OFFLINE_CACHE_FILE_PATH"
_KEPT = (_CACHE, _CACHE_FOLDER, "TI_VISIBLE_DEVICE")
#: Free space below which kernels are not kept [bytes]: those of a scene take some megabytes.
_LEAST_SPACE = 64e6
# Taichi holds the lock of its kernel cache for well under a second.
_STALE_LOCK_S = 10.0

#: Address space that is reserved when Taichi starts, and what kernels and libraries take [bytes].
_LEAST_TO_START, _LEAST_TO_IMPORT = 1_500_000_000, 500_000_000

_own: list[Path] = []


def _prepare_import():
    """Set what Taichi reads when it is imported.

    It would abort without HOME, ask the network for a newer version, and talk.
    """
    for name in list(os.environ):
        if name.startswith("TI_") and name not in _KEPT:
            del os.environ[name]
    os.environ["TI_SKIP_VERSION_CHECK"] = "ON"
    os.environ["ENABLE_TAICHI_HEADER_PRINT"] = "0"
    # In Jupyter Taichi would say when it is imported that it found a graphical shell.
    os.environ["TI_LOG_LEVEL"] = "error"
    if not os.environ.get("HOME"):
        os.environ.pop("HOME", None)
        home = os.path.expanduser("~")
        os.environ["HOME"] = home if os.path.isabs(home) else os.devnull
    _report_interrupts_in_one_line()


@contextlib.contextmanager
def settings_hidden() -> Iterator[None]:
    """In its block Taichi finds no settings in the environment, whoever has put them there."""
    device = "TI_VISIBLE_DEVICE"
    hidden = {n: v for n, v in os.environ.items() if n.startswith("TI_") and n != device}
    for name in hidden:
        del os.environ[name]
    try:
        yield
    finally:
        os.environ.update(hidden)


@contextlib.contextmanager
def interrupts_deferred() -> Iterator[None]:
    """Raise a Ctrl-C of its block at the end: Taichi's own code takes it for another error."""
    noted: list[int] = []
    handler = signal.getsignal(signal.SIGINT)
    mine = threading.current_thread() is threading.main_thread()
    mine = mine and handler is signal.default_int_handler
    if mine:
        signal.signal(signal.SIGINT, lambda number, frame: noted.append(number))
    try:
        yield
    finally:
        if mine:
            signal.signal(signal.SIGINT, handler)
        if noted:
            raise KeyboardInterrupt


def _is_program():
    """Whether Python runs a program, and no shell that goes on after an error."""
    return not (hasattr(sys, "ps1") or sys.flags.interactive)


def _report_interrupts_in_one_line():
    """Replace the traceback of a Ctrl-C that nothing catches, as in an import, in programs."""
    before = sys.excepthook
    if not _is_program() or before is not sys.__excepthook__:
        return

    def hook(kind, error, trace):
        if issubclass(kind, KeyboardInterrupt):
            print("interrupted", file=sys.stderr)
        else:
            before(kind, error, trace)

    sys.excepthook = hook


def kernel_cache(default_folder: str) -> tuple[bool, str]:
    """Whether Taichi shall keep compiled kernels, and the folder; removes a lock left there.

    default_folder: where it would, unless a variable names another. Where neither can be used, it
    is a folder that goes with this process. Raises InputError for what would end Taichi.
    """
    _check_address_space(_LEAST_TO_START)
    wanted = os.environ.get(_CACHE, "")
    if wanted not in ("", "0", "1"):
        raise InputError(f"{_CACHE} must be 0 or 1, got {shown(wanted)}")
    folder = Path(os.environ.get(_CACHE_FOLDER) or default_folder)
    try:
        os.getcwd()
        folder = folder if _is_usable(folder) else _own_folder()
    except OSError as error:
        raise InputError(
            "Taichi needs a current folder and one for temporary files that can be written to: "
            f"{error.strerror or error}"
        ) from None
    _remove_stale_lock(folder)
    return wanted != "0", str(folder)


def _check_address_space(least):
    """Raise InputError where a limit leaves less than that many bytes; Taichi would abort."""
    if resource is None or resource.getrlimit(resource.RLIMIT_AS)[0] == resource.RLIM_INFINITY:
        return
    try:
        mmap.mmap(-1, least).close()
    except (OSError, ValueError, MemoryError):
        raise InputError(
            f"Taichi needs {1e-9 * least:.1f} GB more of address space than the limit of this "
            "process (ulimit -v) leaves"
        ) from None


def _own_folder():
    """A new folder that is removed when the process ends, after Taichi has."""
    if not _own:
        _own.append(Path(tempfile.mkdtemp(prefix="taichi-kernels-")))
    return _own[0]


@atexit.register
def _remove_own_folder():
    for folder in _own:
        shutil.rmtree(folder, ignore_errors=True)


def _is_usable(folder):
    """Whether files can be made in a folder, and those that are there be read and replaced."""
    probe = folder / f".write-test-{os.getpid()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(bytes(4096))
        probe.unlink()
        own = [folder / "ticache.tcb", *folder.glob("*.tic")]
        mine = all(os.access(file, os.R_OK | os.W_OK) for file in own if file.exists())
        return mine and _free_space(folder) >= _LEAST_SPACE
    except (OSError, ValueError):
        return False


def _free_space(folder):
    """Bytes that may be written there, as far as the system says."""
    if not hasattr(os, "statvfs"):
        return float("inf")
    found = os.statvfs(folder)
    return found.f_bavail * found.f_frsize


def _remove_stale_lock(folder):
    """Remove the lock that a killed process left on Taichi's kernel cache.

    With it, every later process would compile all its kernels anew and say so on stderr.
    """
    lock = folder / "ticache.lock"
    with contextlib.suppress(OSError):
        # A clock that was set back leaves a lock of the future.
        if abs(time.time() - lock.stat().st_mtime) > _STALE_LOCK_S:
            lock.unlink()


def _import_taichi():
    """Import Taichi; where it cannot be, a program ends with one line and exit code 2."""
    try:
        _check_address_space(_LEAST_TO_IMPORT)
        with interrupts_deferred(), _import_conditions(), contextlib.redirect_stdout(io.StringIO()):
            importlib.import_module("taichi")
    except (InputError, ImportError, OSError, MemoryError) as error:
        reason = " ".join(str(error).split()) or "out of memory"
        sentence = f"Taichi cannot be imported: {reason}"
        if not _is_program():
            raise ImportError(sentence) from None
        print(sentence, file=sys.stderr)
        raise SystemExit(2) from None


@contextlib.contextmanager
def _import_conditions():
    """Under -W error, although Taichi uses what Python warns of, and in any locale.

    It encodes the name of its folder in the locale's encoding, which may be unknown to Python.
    """
    before = os.environ.get("LC_ALL")
    os.environ["LC_ALL"] = "C.UTF-8"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        if before is None:
            del os.environ["LC_ALL"]
        else:
            os.environ["LC_ALL"] = before


_prepare_import()
_import_taichi()
