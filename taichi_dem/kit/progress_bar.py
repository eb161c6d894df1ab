"""A progress bar on a terminal and in Jupyter; elsewhere a line a phase."""

import contextlib
import html
import math
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
#: Silence after which there is another line: of a phase that begins again, and of one that goes
#: on [s]; and its least share of the time since the first line, so that long jobs have few.
_BEGINS, _GOES_ON, _SHARE = 0.5, 30.0, 0.1
#: Most titles and phases that have a line as they begin, however short the silence.
_MOST_SAID = 100


class ProgressBar:
    """Bar with percent, time left and speed, from entering to leaving its block.

    It is drawn on stderr where that is a terminal, and in the cell of a Jupyter notebook; it leaves
    nothing behind. Where stderr is a pipe or a file, a line is written as a phase begins, and now
    and then while a long one goes on. Call it with a Progress; while kernels are compiled and
    pictures are drawn in its block it says so by itself. Bars in the block are not shown.

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
        if not _open_bars:
            self._show = self._opened.enter_context(_display()(self.title))
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


class _Lines:
    """What has been written on stderr: titles and phases, and since when and when last [s]."""

    def __init__(self, shown: bool = True):
        self.shown, self._said = shown, set[tuple[str, str]]()
        self._first, self._last = math.inf, -math.inf

    def write(self, title: str, progress: Progress, begins: bool) -> None:
        """Write a line unless there was one of late; begins: whether the phase does so now."""
        phase, now = (title, progress.phase), time.perf_counter()
        new = phase not in self._said and len(self._said) < _MOST_SAID
        least = max(_BEGINS if begins else _GOES_ON, _SHARE * (now - self._first))
        if new or now - self._last >= least:
            self._said.add(phase)
            self._first, self._last = min(self._first, now), now
            with contextlib.suppress(OSError, ValueError):
                # A run does not end because nobody reads its lines.
                words = progress.phase if new else progress
                print(f"{title}: {words}", file=sys.stderr, flush=True)


#: The innermost block of ``showing`` last.
_lines_of = [_Lines()]


@contextlib.contextmanager
def showing(shown: bool) -> Iterator[None]:
    """Show progress in the block, as a program that has not written a line yet, or none at all."""
    _lines_of.append(_Lines(shown))
    try:
        yield
    finally:
        _lines_of.pop()


def hide_bars() -> None:
    """Show no further bar in this process, which works for another one and shares its terminal."""
    _lines_of[-1].shown = False


@contextlib.contextmanager
def reporting(progress: Listener | str | None, title: str) -> Iterator[Listener | None]:
    """Listener to the Progress of a job for its argument ``progress``; None for silence."""
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
    if not _lines_of[-1].shown or getattr(sys.stderr, "closed", True):
        return _nothing
    python = sys.modules.get("IPython")
    if python is not None and hasattr(python.get_ipython(), "kernel"):
        return _notebook
    # A dumb terminal cannot move its cursor.
    return _terminal if sys.stderr.isatty() and os.environ.get("TERM") != "dumb" else _lines


def _ignore(progress):
    """Show nothing."""


@contextlib.contextmanager
def _nothing(title):
    yield _ignore


@contextlib.contextmanager
def _lines(title):
    lines, last = _lines_of[-1], ""

    def show(progress):
        nonlocal last
        begins, last = progress.phase != last, progress.phase
        lines.write(title, progress, begins)

    yield show


@contextlib.contextmanager
def _terminal(title):
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
