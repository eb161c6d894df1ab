"""A progress bar on a terminal and in Jupyter; elsewhere a line a phase, or nothing."""

import contextlib
import html
import os
import sys
import time
from collections.abc import Iterator

from taichi_dem.kit.display import in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import Counted, Listener, Pace, Progress, listening
from taichi_dem.kit.validation import fraction, instance, progress_option, shown, whole

#: Least time between two updates of a cell in Jupyter [s].
_NOTEBOOK_SECONDS = 0.2
#: Columns of a terminal below which there is no room for the bar beside its words.
_NARROW = 70
#: Bars that are shown now; a second one below the first would garble both.
_open_bars: list["ProgressBar"] = []
#: Blocks of ``no_bars`` that are open now.
_silent_blocks: list[object] = []
#: For each block of ``phase_lines`` the titles and phases that have had their line.
_said: list[set[tuple[str, str]]] = []


class ProgressBar:
    """Bar with percent, time left and speed, from entering to leaving its block.

    It is drawn on stderr where that is a terminal, and in the cell of a Jupyter notebook; it leaves
    nothing behind. A program of the experiments has a line a phase instead where stderr is a pipe
    or a file. Call it with a Progress; while kernels are compiled and pictures are drawn in its
    block it says so by itself.

    Parameters
    ----------
    title : str
        What is being done.

    Raises
    ------
    InputError
        The bar is entered twice.

    Examples
    --------
    >>> with ProgressBar("runs") as bar:
    ...     for k in range(3):
    ...         bar.count(k, total=3)
    """

    def __init__(self, title: str):
        self.title = instance("title", title, str)
        self._opened = contextlib.ExitStack()
        self._started, self._display = time.perf_counter(), _Nothing()

    def __repr__(self):
        return in_brief(self, self.title)

    def __enter__(self) -> "ProgressBar":
        if self in _open_bars:
            raise InputError(f"the progress bar {self.title!r} is shown already")
        self._started = time.perf_counter()
        self._display = _Nothing() if _open_bars else _display_for(self.title)
        _open_bars.append(self)
        self._opened.enter_context(listening(self))
        return self

    def __call__(self, progress: Progress) -> None:
        """Show a Progress. Raises TypeError for anything else, watched or not."""
        if not isinstance(progress, Progress):
            raise TypeError(f"a progress bar takes a Progress, got {shown(progress)}")
        self._display.show(progress)

    def at(self, share: float) -> None:
        """Show the progress of a job that knows no more than its share.

        Parameters
        ----------
        share : float
            Share that is done, from 0 to 1.
        """
        fraction("share", share)
        self(Progress(share, time.perf_counter() - self._started))

    def count(self, done: int, total: int) -> None:
        """Show how many runs are done of a job that consists of several.

        Parameters
        ----------
        done : int
            Number of runs that are done.
        total : int
            Number of all runs.
        """
        whole("total", total, 0, 2**63)
        whole("done", done, 0, total)
        self(Counted(done / max(1, total), time.perf_counter() - self._started, done, total))

    def __exit__(self, *error):
        self._opened.close()
        _open_bars.remove(self)
        self._display.close()
        self._display = _Nothing()


@contextlib.contextmanager
def no_bars() -> Iterator[None]:
    """Show no bar in the block, whoever watches."""
    _silent_blocks.append(None)
    try:
        yield
    finally:
        _silent_blocks.pop()


@contextlib.contextmanager
def phase_lines() -> Iterator[None]:
    """In the block write a line a phase of each title, where stderr is neither of both."""
    _said.append(set())
    try:
        yield
    finally:
        _said.pop()


@contextlib.contextmanager
def reporting(progress: Listener | str | None, title: str) -> Iterator[Listener | None]:
    """Listener to the Progress of a job for its argument ``progress``; None for silence.

    "auto" gives a bar where somebody watches. A function is also told of compiling.
    """
    if progress_option("progress", progress) is None:
        yield None
    elif callable(progress):
        with listening(progress):
            yield progress
    else:
        with ProgressBar(title) as bar:
            yield bar


def hide_bars() -> None:
    """Show no further bar in this process, which works for another one and shares its terminal."""
    if not _open_bars:
        _open_bars.append(ProgressBar("hidden"))


class _Nothing:
    """Silent bar, where there is neither a terminal nor Jupyter."""

    def show(self, progress):
        """Do nothing."""

    def close(self):
        """Do nothing."""


class _Terminal:
    """A bar on a terminal, by rich."""

    def __init__(self, title):
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

        console = Console(stderr=True)
        # A title is no markup; dots of Braille are not in every encoding.
        texts = [
            TextColumn(f"{{task.{field}}}", markup=False)
            for field in ("description", "fields[words]")
        ]
        spinner = SpinnerColumn("dots" if console.encoding.startswith("utf") else "line")
        self._narrow = console.width < _NARROW
        bars = () if self._narrow else (BarColumn(None),)
        # The bar takes the rest of a line. Prints go where they would go without it.
        self._bar = Progress(
            *(spinner, texts[0], *bars, texts[1]),
            console=console,
            transient=True,
            expand=not self._narrow,
            redirect_stdout=sys.stdout is not None and sys.stdout.isatty(),
        )
        self._task = self._bar.add_task(title, total=1.0, words="")
        self._bar.start()

    def show(self, progress):
        """Draw the progress of the job."""
        # Rich's own thread redraws ten times a second, but not while Taichi compiles a kernel.
        at_once = progress.phase == "compiling"
        parts = str(progress).split(", ")
        words = ", ".join(parts[:2] if self._narrow else parts)
        self._bar.update(self._task, completed=progress.share, words=words, refresh=at_once)

    def close(self):
        """Remove the bar."""
        self._bar.stop()


class _Phases:
    """A line on stderr for each phase of each title."""

    def __init__(self, title):
        self._title = title

    def show(self, progress):
        """Write the line where there was none."""
        phase = self._title, progress.phase
        if phase not in _said[-1]:
            _said[-1].add(phase)
            print(": ".join(phase), file=sys.stderr, flush=True)

    def close(self):
        """Leave the lines as written."""


class _PlainTerminal:
    """Lines on a terminal that cannot move its cursor: parts of compiling, tenths of the run."""

    def __init__(self, title):
        self._title, self._said = title, None

    def show(self, progress):
        """Write a line where there is something new."""
        now = progress.phase, getattr(progress, "file", int(10 * progress.share))
        if now != self._said:
            self._said = now
            print(f"{self._title}: {progress}", file=sys.stderr, flush=True)

    def close(self):
        """Leave the text as written."""


class _Notebook:
    """A bar below the cell of a Jupyter notebook that is running."""

    def __init__(self, title, display):
        self._title, self._pace = title, Pace(_NOTEBOOK_SECONDS)
        self._handle = display(self._drawn(0.0, ""), raw=True, display_id=True)

    def _drawn(self, share, words):
        bar = f'<progress value="{share:.3f}" max="1"></progress>'
        marked = f"{html.escape(self._title)} {bar} {html.escape(words)}"
        return {"text/plain": f"{self._title}: {words}", "text/html": marked}

    def show(self, progress):
        """Draw the progress of the job."""
        if self._pace.should_report(progress.phase == "compiling"):
            self._handle.update(self._drawn(progress.share, str(progress)), raw=True)

    def close(self):
        """Empty the place of the bar."""
        self._handle.update({"text/plain": "", "text/html": ""}, raw=True)


def _display_for(title):
    if _silent_blocks:
        return _Nothing()
    shell = _notebook_shell()
    if shell is not None:
        return _Notebook(title, sys.modules["IPython"].display.display)
    if sys.stderr is None or not sys.stderr.isatty():
        return _Phases(title) if _said and sys.stderr is not None else _Nothing()
    return _PlainTerminal(title) if os.environ.get("TERM") == "dumb" else _Terminal(title)


def _notebook_shell():
    """The shell of a Jupyter kernel that this process is, or None."""
    python = sys.modules.get("IPython")
    shell = python.get_ipython() if python is not None else None
    return shell if shell is not None and hasattr(shell, "kernel") else None
