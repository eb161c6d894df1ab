"""The only place that starts Taichi: architecture, threads, and the settings that keep bits equal.

Imported before any other module of the package: Taichi reads variables when first imported.
"""

import atexit
import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Optional

# First, out of order: it prepares the environment for ``import taichi``.
from taichi_dem.kit.taichi_patches.environment import kernel_cache, taichi_alone  # isort: skip

import taichi as ti
from taichi.lang import impl

from taichi_dem.kit import backend
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.taichi_patches import llvm_options
from taichi_dem.kit.taichi_patches.kernel_source_cache import remember
from taichi_dem.kit.validation import choice, flag, whole

# Before any other module has Taichi decorate its functions.
remember()

ARCHITECTURES = backend.ARCHITECTURES


@dataclass(frozen=True)
class Settings:
    """Settings with which Taichi was started.

    Parameters
    ----------
    arch : str
        ``"cpu"``, ``"cuda"`` or ``"vulkan"``.
    threads : int
        CPU threads of parallel loops.
    debug : bool
        Whether kernels check array bounds.
    """

    arch: str
    threads: int
    debug: bool


_session: Optional["Session"] = None
_on_clear: list[Callable[[], object]] = []


class Session:
    """One start of Taichi, used by one thread of one process; objects remember theirs.

    cleared: whether its engines have been given back since.
    """

    def __init__(self, settings: Settings):
        self.settings, self.program = settings, impl.get_runtime().prog
        self.thread, self.process = threading.get_ident(), os.getpid()
        self.cleared = False

    def _is_running(self) -> bool:
        """Whether neither ti.init nor ti.reset has ended it."""
        return impl.get_runtime().prog is self.program


def start(arch: str = "cpu", threads: int | None = None, debug: bool = False) -> Settings:
    """Start Taichi, or do nothing when it already runs with these settings.

    Parameters
    ----------
    arch : str, default "cpu"
        ``"cpu"``, ``"cuda"``, ``"vulkan"``, or ``"gpu"``: the first of the last two that answers.
    threads : int, optional
        Number of CPU threads; all cores if None.
    debug : bool, default False
        Check array bounds inside kernels (about three times slower).

    Raises
    ------
    InputError
        The architecture is unknown or absent, or its device has no doubles; the number of threads
        is out of range; or Taichi already runs otherwise, or in the process that forked this.
    """
    global _session
    wanted = _checked(arch, threads, debug)
    _check_process()
    if _session and _session._is_running():
        if wanted != _session.settings:
            raise InputError(
                f"Taichi already runs with {_session.settings}, asked for {wanted}: call stop()"
            )
        return _session.settings
    _initialise(wanted)
    _session = Session(wanted)
    return wanted


def stop() -> None:
    """End the Taichi session and free its engines; simulations and batches become invalid."""
    global _session
    _check_process()
    here = threading.get_ident()
    others = {thread.ident for thread in threading.enumerate()} - {here}
    if _session is not None and _session.thread in others:
        check_thread("session")
    if _session is not None and _session.thread == here and _session._is_running():
        _free_engines()
    _reset()
    _session = None


def clear() -> None:
    """Free all engines with fields and kernels; simulations and batches so far become invalid.

    Taichi is started anew with the same settings, as it keeps each kernel until then: fields of
    your own become invalid too. Does nothing before the first start.
    """
    global _session
    if _session is None:
        return
    check_session(_session, "session")
    _free_engines()
    _session.cleared = True
    _reset()
    _initialise(_session.settings)
    _session = Session(_session.settings)


def _free_engines():
    for forget in _on_clear:
        forget()


def when_cleared(forget: Callable[[], object]) -> None:
    """Have a function called by ``clear`` and ``stop``."""
    _on_clear.append(forget)


def session() -> Session:
    """The running session; objects that own fields remember the one they were made in."""
    if _session is None:
        raise InputError("Taichi is not started: call runtime.start() first")
    _check_process()
    return _session


def _check_process():
    """Raise InputError in a fork of the process that started Taichi."""
    if _session is not None and _session.process != os.getpid():
        raise InputError(
            "Taichi was started before this process was forked, and would hang in it: start "
            'processes by multiprocessing.get_context("spawn"), or start Taichi only in them'
        )


def check_session(made_in: Session, what: str) -> None:
    """Refuse a session that is not the present one, intact, and used by its own thread."""
    if made_in.cleared:
        raise InputError(f"the memory of this {what} has been given back by runtime.clear()")
    _check_process()
    if made_in is not _session:
        raise InputError(f"this {what} belongs to a Taichi session that has been stopped")
    if not made_in._is_running():
        raise InputError(
            f"this {what} belongs to a Taichi session that ti.init or ti.reset has ended: start "
            "and stop Taichi by runtime.start() and runtime.stop() only"
        )
    check_thread(what)


def check_thread(what: str) -> None:
    """Refuse another thread than the one that started Taichi."""
    if threading.get_ident() != session().thread:
        raise InputError(
            f"a {what} must be made, used and ended on the thread that called runtime.start(): "
            "Taichi would crash on another"
        )


def settings() -> Settings | None:
    """Settings of the running session; None before the first start."""
    return _session.settings if _session else None


def usable_cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@atexit.register
def _end_session():
    """End the session while all modules are there, so that Taichi writes its kernel cache."""
    # At interpreter exit Taichi's kernel cache is lost if anything still refers to a class with
    # kernels, as the caches of ``typing`` do.
    if _session and _session.thread == threading.get_ident() and _session.process == os.getpid():
        if impl.get_runtime().prog is _session.program:
            _reset()


def _checked(arch, threads, debug):
    choice("arch", arch, ARCHITECTURES)
    count = usable_cores() if threads is None else whole("threads", threads, 1, 1024)
    return Settings(backend.found(arch), count, flag("debug", debug))


def _initialise(wanted):
    if wanted.arch == "cpu":
        llvm_options.switch_off()
    keeps, folder = kernel_cache(impl.default_cfg().offline_cache_file_path)
    with taichi_alone():
        ti.init(
            arch=backend.GPUS.get(wanted.arch, ti.cpu),
            default_fp=ti.f64,
            default_ip=ti.i32,
            fast_math=False,
            # Three times the compile time for nothing: LLVM optimises these kernels as well alone.
            # Kernels then must not add to fields in place: see tests/unit/test_source_rules.py.
            advanced_optimization=False,
            cpu_max_num_threads=wanted.threads,
            debug=wanted.debug,
            # Below errors Taichi only reports a cache that another process is writing.
            log_level=ti.ERROR,
            offline_cache=keeps,
            offline_cache_file_path=folder,
            # By default 100 MB, less than one run of the tests writes.
            offline_cache_max_size_of_files=2**31 - 1,
            random_seed=0,
            # Loops over phases are unrolled; Taichi warns of more than 32.
            unrolling_limit=0,
        )
    # Taichi falls back to the CPU with a mere warning.
    got = impl.current_cfg().arch
    if got != backend.GPUS.get(wanted.arch, got) or backend.is_cpu() != (wanted.arch == "cpu"):
        _reset()
        raise InputError(f"arch {wanted.arch!r} was asked for, but Taichi started {got}")
    try:
        backend.probe()
    except InputError:
        _reset()
        raise


def _reset():
    with taichi_alone():
        ti.reset()
