"""Variables and folders on which Taichi depends; Taichi is imported here for the first time."""

import atexit
import contextlib
import importlib
import io
import os
import shutil
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

#: Taichi's own switch of its kernel cache, and its folder.
_CACHE, _CACHE_FOLDER = "TI_OFFLINE_CACHE", "TI_OFFLINE_CACHE_FILE_PATH"
#: What Taichi finds instead: it would ask the network for a newer version, and talk.
_OURS = {"TI_SKIP_VERSION_CHECK": "ON", "ENABLE_TAICHI_HEADER_PRINT": "0"}
#: Free space below which kernels are not kept [bytes]: those of a scene take some megabytes.
_LEAST_SPACE = 64e6
#: Taichi holds the lock of its kernel cache for well under a second.
_STALE_LOCK_S = 10.0

_own: list[Path] = []


@contextlib.contextmanager
def taichi_alone(**more: str) -> Iterator[None]:
    """In its block Taichi finds none of its variables but ours, and says and warns nothing."""
    # Without HOME Taichi aborts.
    before = dict(os.environ)
    hidden = [name for name in before if name.startswith("TI_") and name != "TI_VISIBLE_DEVICE"]
    ours = {**_OURS, "HOME": before.get("HOME") or os.path.expanduser("~"), **more}
    for name in hidden:
        del os.environ[name]
    os.environ.update(ours)
    try:
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for name in ours:
            del os.environ[name]
        os.environ.update({name: before[name] for name in (*hidden, *ours) if name in before})


def kernel_cache(default_folder: str) -> tuple[bool, str]:
    """Whether Taichi shall keep compiled kernels, and the folder; removes a lock left there."""
    folder = Path(os.environ.get(_CACHE_FOLDER) or default_folder)
    if not _is_usable(folder):
        _own[:] = _own or [Path(tempfile.mkdtemp(prefix="taichi-kernels-"))]
        folder = _own[0]
    _remove_stale_lock(folder)
    return os.environ.get(_CACHE) != "0", str(folder)


@atexit.register
def _remove_own_folder():
    """After Taichi has ended, as ``runtime`` is imported later."""
    for folder in _own:
        shutil.rmtree(folder, ignore_errors=True)


def _is_usable(folder):
    """Whether files can be made in a folder, and those that are there be read and replaced."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(bytes(4096))
        own = [folder / "ticache.tcb", *folder.glob("*.tic")]
        mine = all(os.access(file, os.R_OK | os.W_OK) for file in own if file.exists())
        return mine and shutil.disk_usage(folder).free >= _LEAST_SPACE
    except OSError:
        return False


def _remove_stale_lock(folder):
    """Remove the lock that a killed process left on Taichi's kernel cache."""
    # With this lock every later process compiles all its kernels anew.
    lock = folder / "ticache.lock"
    with contextlib.suppress(OSError):
        # A clock that was set back leaves a lock of the future.
        if abs(time.time() - lock.stat().st_mtime) > _STALE_LOCK_S:
            lock.unlink()


# In Jupyter Taichi would say that it found a graphical shell.
with taichi_alone(TI_LOG_LEVEL="error"):
    importlib.import_module("taichi")
    importlib.import_module("taichi_dem.kit.taichi_patches.names").check_needed()
