"""The only place that starts Taichi: architecture, threads, and the settings that keep bits equal.

Imported before any other module of the package, because some environment variables must stand
before the first ``import taichi``: HOME (Taichi aborts without it), and the switches that keep it
from asking the network for a newer version and from talking.
"""

import contextlib
import io
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
# TI_ARCH would overrule the architecture that the caller asks for without a word.
os.environ.pop("TI_ARCH", None)
if not os.environ.get("HOME"):
    os.environ["HOME"] = tempfile.mkdtemp(prefix="taichi-home-")

# In Jupyter Taichi would say when it is imported that it found a graphical shell.
os.environ.setdefault("TI_LOG_LEVEL", "error")
import taichi as ti
from taichi.lang import impl

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.kernel_source_cache import remember
from taichi_dem.kit.validation import choice, flag, whole

ARCHITECTURES = ("cpu", "cuda")


@dataclass(frozen=True)
class Settings:
    """What Taichi was started with.

    arch: "cpu" or "cuda". threads: CPU threads of parallel loops. debug: bounds checks in kernels.
    """

    arch: str
    threads: int
    debug: bool


# Taichi holds the lock of its kernel cache for well under a second.
_STALE_LOCK_S = 10.0

_current = None
_generation = 0


def start(arch="cpu", threads=None, debug=False):
    """Start Taichi, or do nothing when it already runs with these settings.

    arch: "cpu" or "cuda". threads: number of CPU threads, all cores by default. debug: check
    array bounds inside kernels (about three times slower).
    Returns the settings in force. Raises InputError for an unknown or absent architecture, a
    thread count below one, or a second start with other settings in the same process.
    """
    global _current, _generation
    wanted = _checked(arch, threads, debug)
    if _current is not None and impl.get_runtime().prog is not None:
        if wanted != _current:
            raise InputError(
                f"Taichi already runs with {_current}, asked for {wanted}: call stop()"
            )
        return _current
    _initialise(wanted)
    _current = wanted
    _generation += 1
    return _current


def stop():
    """End the Taichi session; every model, state and result field made in it becomes invalid."""
    global _current
    ti.reset()
    _current = None


def generation():
    """Number of the running session; objects that own fields remember the one they were made in.

    Raises InputError when Taichi was not started.
    """
    if _current is None:
        raise InputError("Taichi is not started: call runtime.start() first")
    return _generation


def settings():
    """Settings of the running session, or None before the first start."""
    return _current


def _checked(arch, threads, debug):
    choice("arch", arch, ARCHITECTURES)
    cores = os.cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):
        cores = len(os.sched_getaffinity(0))
    count = cores if threads is None else whole("threads", threads, 1, 1024)
    return Settings(arch, count, flag("debug", debug))


def _initialise(wanted):
    # Taichi falls back to the CPU with a mere warning: ask first, and read back what it took.
    if wanted.arch == "cuda" and not cuda_present():
        raise InputError("arch 'cuda' was asked for, but no CUDA device answers here: use 'cpu'")
    _remove_stale_lock()
    remember()
    # ti.init would warn that its argument overrules this switch, which only its import needed.
    os.environ.pop("TI_LOG_LEVEL", None)
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(
            arch=ti.cuda if wanted.arch == "cuda" else ti.cpu,
            default_fp=ti.f64,
            default_ip=ti.i32,
            fast_math=False,
            # Three times the compile time for nothing: LLVM optimises these kernels as well alone.
            # Kernels then must not add to fields in place: see tests/unit/test_kernel_source.py.
            advanced_optimization=False,
            cpu_max_num_threads=wanted.threads,
            debug=wanted.debug,
            # Below errors Taichi only tells of a cache that another process is writing.
            log_level=ti.ERROR,
            random_seed=0,
        )
    got = impl.current_cfg().arch
    if (got == ti.cuda) != (wanted.arch == "cuda"):
        ti.reset()
        raise InputError(f"arch {wanted.arch!r} was asked for, Taichi started {got}")


def _remove_stale_lock():
    """Remove the lock that a killed process left on Taichi's kernel cache.

    With it, every later process would compile all its kernels anew and say so on stderr.
    """
    default = impl.default_cfg().offline_cache_file_path
    folder = os.environ.get("TI_OFFLINE_CACHE_FILE_PATH", default)
    lock = Path(folder, "ticache.lock")
    with contextlib.suppress(OSError):
        if time.time() - lock.stat().st_mtime > _STALE_LOCK_S:
            lock.unlink()


def cuda_present():
    """Whether a CUDA device answers on this machine."""
    # Taichi would say on stderr that it finds no libcuda; the caller says it in a sentence.
    ti.set_logging_level(ti.ERROR)
    return bool(ti._lib.core.with_cuda())
