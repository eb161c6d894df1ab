"""A progress bar on a terminal and in Jupyter; elsewhere a line a phase, or nothing."""

import contextlib
import html
import os
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

from taichi_dem.kit.progress import Listener, Pace, Progress, listening
from taichi_dem.kit.validation import fraction, instance, progress_option, shown, whole

#: Least time between two updates of a cell in Jupyter [s].
_NOTEBOOK_SECONDS = 0.2
#: Columns of a terminal below which there is no room for the bar beside its words.
_NARROW = 70
#: Bars that are shown now; a second one below the first would garble both.
_open_bars: list["ProgressBar"] = []
#: How progress is shown, the innermost block last: "bars", "lines" or "nothing".
_modes = ["bars"]
#: Titles and phases that have had their line.
_said: set[tuple[str, str]] = set()


class ProgressBar:
    """Bar with percent, time left and speed, from entering to leaving its block.

    It is drawn on stderr where that is a terminal, and in the cell of a Jupyter notebook; it leaves
    nothing behind. A program of the experiments has a line a phase instead where stderr is a pipe
    or a file. Call it with a Progress; while kernels are compiled and pictures are drawn in its
    block it says so by itself.

    Parameters
    ----------
    title : str
        Name of the job.

    Examples
    --------
    >>> with ProgressBar("runs") as bar:
    ...     for k in range(3):
    ...         bar.count(k, total=3)
    """

    def __init__(self, title: str):
        self.title = instance("title", title, str)
        self._opened, self._started = contextlib.ExitStack(), time.perf_counter()
        self._show: Callable[[Progress], object] = _ignore

    def __repr__(self):
        return f"ProgressBar({self.title!r})"

    def __enter__(self) -> "ProgressBar":
        self._started = time.perf_counter()
        display = _nothing if _open_bars else _display()
        self._show = self._opened.enter_context(display(self.title))
        self._opened.enter_context(listening(self))
        _open_bars.append(self)
        return self

    def __call__(self, progress: Progress) -> None:
        """Show a Progress. Raises TypeError for anything else, watched or not."""
        if not isinstance(progress, Progress):
            raise TypeError(f"a progress bar takes a Progress, got {shown(progress)}")
        self._show(progress)

    def at(self, share: float) -> None:
        """Show the progress of a job that knows only its share.

        Parameters
        ----------
        share : float
            Share that is done, from 0 to 1.
        """
        fraction("share", share)
        self(Progress(share, time.perf_counter() - self._started))

    def count(self, done: int, total: int) -> None:
        """Show how many runs of a job are done.

        Parameters
        ----------
        done : int
            Number of runs that are done.
        total : int
            Number of all runs.
        """
        whole("total", total, 0, 2**63)
        whole("done", done, 0, total)
        seconds, words = time.perf_counter() - self._started, f"{done} of {total} runs"
        self(Progress(done / max(1, total), seconds, words=words))

    def __exit__(self, *error):
        _open_bars.remove(self)
        self._opened.close()
        self._show = _ignore


@contextlib.contextmanager
def showing(mode: str) -> Iterator[None]:
    """Show progress in the block as "bars", as "lines" where there can be no bars, or "nothing"."""
    _modes.append(mode)
    _said.clear()
    try:
        yield
    finally:
        _modes.pop()


def hide_bars() -> None:
    """Show no further bar in this process, which works for another one and shares its terminal."""
    _modes.append("nothing")


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


def _display():
    """How progress is shown here: a context that gives a function of a Progress, by its title."""
    if _modes[-1] == "nothing" or sys.stderr is None:
        return _nothing
    python = sys.modules.get("IPython")
    if python is not None and hasattr(python.get_ipython(), "kernel"):
        return _notebook
    if sys.stderr.isatty():
        # A dumb one cannot move its cursor.
        return _lines if os.environ.get("TERM") == "dumb" else _terminal
    return _lines if _modes[-1] == "lines" else _nothing


def _ignore(progress):
    """Show nothing."""


@contextlib.contextmanager
def _nothing(title):
    yield _ignore


@contextlib.contextmanager
def _lines(title):
    """A line on stderr for each phase of each title."""

    def show(progress):
        phase = title, progress.phase
        if phase not in _said:
            _said.add(phase)
            print(": ".join(phase), file=sys.stderr, flush=True)

    yield show


@contextlib.contextmanager
def _terminal(title):
    """A bar on a terminal, by rich."""
    from rich.console import Console
    from rich.progress import BarColumn, SpinnerColumn, TextColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    narrow = console.width < _NARROW
    # A title is no markup; dots of Braille are not in every encoding.
    spinner = SpinnerColumn("dots" if console.encoding.startswith("utf") else "line")
    name, words = (TextColumn(f"{{task.{f}}}", markup=False) for f in ("description", "fields[w]"))
    columns = (spinner, name, words) if narrow else (spinner, name, BarColumn(None), words)
    # Prints go where they would go without the bar.
    redirect = sys.stdout is not None and sys.stdout.isatty()
    options: Any = {"transient": True, "expand": not narrow, "redirect_stdout": redirect}
    with Bar(*columns, console=console, **options) as bar:
        task = bar.add_task(title, total=1.0, w="")

        def show(progress):
            # Rich's own thread redraws ten times a second, but not while Taichi compiles a kernel.
            at_once, parts = progress.phase == "compiling", str(progress).split(", ")
            text = ", ".join(parts[:2] if narrow else parts)
            bar.update(task, completed=progress.share, w=text, refresh=at_once)

        yield show


@contextlib.contextmanager
def _notebook(title):
    """A bar below the cell of a Jupyter notebook that is running, gone at its end."""
    pace, show_new = Pace(_NOTEBOOK_SECONDS), sys.modules["IPython"].display.display

    def drawn(share, words):
        bar = f'<progress value="{share:.3f}" max="1"></progress>'
        marked = f"{html.escape(title)} {bar} {html.escape(words)}"
        return {"text/plain": f"{title}: {words}", "text/html": marked}

    handle = show_new(drawn(0.0, ""), raw=True, display_id=True)

    def show(progress):
        if pace.should_report(progress.phase == "compiling"):
            handle.update(drawn(progress.share, str(progress)), raw=True)

    try:
        yield show
    finally:
        handle.update({"text/plain": "", "text/html": ""}, raw=True)
