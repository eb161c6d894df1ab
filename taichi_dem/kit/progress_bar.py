"""A progress bar on a terminal and in Jupyter; elsewhere a line a phase."""

import contextlib
import functools
import html
import math
import os
import sys
import time
from collections.abc import Iterator
from typing import Any

from taichi_dem.kit.progress import Listener, Pace, Progress, listening
from taichi_dem.kit.validation import instance, progress_option, shown, whole

#: Least time between two updates of a cell in Jupyter [s].
_NOTEBOOK_SECONDS = 0.2
#: Silence after which a phase has another line [s], and its least share of the time since the first
#: line, so that long jobs have few.
_SILENCE, _SHARE = 30.0, 0.1
#: Most titles and phases that have a line as they begin, however short the silence.
_MOST_SAID = 100
#: Bars that are shown now; a second one below the first would garble both.
_open_bars: list["ProgressBar"] = []


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
        self._show: Listener | None = None

    def __repr__(self):
        return f"ProgressBar({self.title!r})"

    def __enter__(self) -> "ProgressBar":
        self._started = time.perf_counter()
        if not _open_bars:
            self._show = self._opened.enter_context(_display(self.title))
            self._opened.enter_context(listening(self))
        _open_bars.append(self)
        return self

    def __call__(self, progress: Progress) -> None:
        """Show a Progress. Raises TypeError for anything else, watched or not."""
        if not isinstance(progress, Progress):
            raise TypeError(f"a progress bar takes a Progress, got {shown(progress)}")
        if self._show:
            self._show(progress)

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
        self._show = None


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


class _Lines:
    """What has been written on stderr: titles and phases, and since when and when last [s]."""

    def __init__(self, shown: bool = True):
        self.shown, self._said = shown, set[tuple[str, str]]()
        self._first, self._last = math.inf, -math.inf

    def write(self, title: str, progress: Progress) -> None:
        """Write a line as a phase begins, and again where there was none of late."""
        phase, now = (title, progress.phase), time.perf_counter()
        new = phase not in self._said and len(self._said) < _MOST_SAID
        if new or now - self._last >= max(_SILENCE, _SHARE * (now - self._first)):
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


def _display(title):
    """How progress is shown here: a context that gives a function of a Progress, or None."""
    lines = _lines_of[-1]
    if not lines.shown or getattr(sys.stderr, "closed", True):
        return contextlib.nullcontext()
    python = sys.modules.get("IPython")
    if python is not None and hasattr(python.get_ipython(), "kernel"):
        return _notebook(title, python.display)
    # A dumb terminal cannot move its cursor.
    if sys.stderr.isatty() and os.environ.get("TERM") != "dumb":
        return _terminal(title)
    return contextlib.nullcontext(functools.partial(lines.write, title))


@contextlib.contextmanager
def _terminal(title):
    """A bar on a terminal, by rich."""
    from rich import progress as bars
    from rich.console import Console

    # A title is no markup.
    texts = "{task.description}", "{task.fields[words]}"
    name, words = (bars.TextColumn(text, markup=False) for text in texts)
    # Prints go where they would go without the bar.
    redirect = sys.stdout is not None and sys.stdout.isatty()
    options: Any = {"transient": True, "expand": True, "redirect_stdout": redirect}
    columns = bars.SpinnerColumn("line"), name, bars.BarColumn(None), words
    with bars.Progress(*columns, console=Console(stderr=True), **options) as bar:
        task = bar.add_task(title, total=1.0, words="")

        def show(progress):
            # Rich's own thread redraws ten times a second, but not while Taichi compiles a kernel.
            at_once = progress.phase == "compiling"
            bar.update(task, completed=progress.share, words=str(progress), refresh=at_once)

        yield show


@contextlib.contextmanager
def _notebook(title, display):
    """A bar below the cell of a Jupyter notebook that is running, gone at its end."""
    pace, handle = Pace(_NOTEBOOK_SECONDS), display.display(display.HTML(""), display_id=True)

    def show(progress):
        if pace.should_report(progress.phase == "compiling"):
            bar = f'<progress value="{progress.share:.3f}" max="1"></progress>'
            words = f"{html.escape(title)} {bar} {html.escape(str(progress))}"
            handle.update(display.HTML(words))

    try:
        yield show
    finally:
        handle.update(display.HTML(""))
