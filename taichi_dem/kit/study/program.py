"""Options, endings and exit codes of a study that is run as a program."""

import argparse
import contextlib
import functools
import os
import re
import signal
import sys
import time
import warnings
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

from taichi_dem.kit import runtime
from taichi_dem.kit.checkpoint import Checkpoint, Interrupted
from taichi_dem.kit.children import Terminated, ending_children
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.files import older_files, output_folder
from taichi_dem.kit.progress_bar import showing
from taichi_dem.kit.study.entries import Entry, entry_of, show_opening
from taichi_dem.kit.terminal import lasting_output
from taichi_dem.kit.validation import did_you_mean, shown

#: Name -> (full, quick), or (full, quick, type, help) for a setting that is an option too: value
#: of the full job, of the quick job.
Settings = Mapping[str, tuple]
_INTERVALS = {None: "every_wall_s", "s": "every_wall_s", "steps": "every_steps", "sim": "every_s"}


class Parser(ArgumentParser):
    """An argument parser whose complaints are one sentence."""

    folder = ""
    settings: Settings = MappingProxyType({})
    entry: Entry | None = None

    def error(self, message: str) -> NoReturn:
        """Turn a wrong command line into an InputError."""
        options = [option for action in self._actions for option in action.option_strings]
        if wrong := re.search(r"unrecognized arguments: (\S+)", message):
            message += did_you_mean(wrong[1], options)
        elif wrong := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message):
            message += did_you_mean(wrong[1], re.findall(r"\w+", wrong[2]))
        raise InputError(message)


def number(low: float, high: float, *, open_low: bool = True) -> Callable[[str], float]:
    """Type of an option that is a number in a range; the complaint names the range."""
    words = f"a number in {'(' if open_low else '['}{low:g}, {high:g})"
    return _checked(float, words, lambda x: low < x < high or (x == low and not open_low))


def whole(low: int, high: int) -> Callable[[str], int]:
    """Type of an option that is a whole number in a range."""
    return _checked(int, f"a whole number from {low} to {high}", lambda x: low <= x <= high)


def one_of(names: Collection[str]) -> Callable[[str], str]:
    """Type of an option that is one of some names."""
    return _checked(str, f"one of {', '.join(names)}", lambda x: x in names)


def tolerance(text: str) -> float:
    """Type of an option that is a share in (0, 1], such as 1% or 0.01."""
    words = "a share above 0 and up to 100%, such as 1% or 0.01"
    return _checked(_share, words, lambda x: 0.0 < x <= 1.0)(text)


def _share(text):
    return 0.01 * float(text[:-1]) if text.endswith("%") else float(text)


def interval(text: str) -> dict:
    """Type of an option that says how often: 600s on the wall, 5000steps, or 1e-5sim seconds."""
    words = "like 600s (wall time), 5000steps or 1e-5sim"
    return _checked(_interval, words, lambda given: Checkpoint("any", **given))(text)


def _interval(text):
    match: Any = re.fullmatch(r"([0-9.]+(?:[eE][-+]?[0-9]+)?)(s|steps|sim)?", text)
    unit = _INTERVALS[match[2]]
    return {unit: int(match[1]) if unit == "every_steps" else float(match[1])}


def _checked(kind, words, allowed):
    def parse(text):
        with contextlib.suppress(ValueError, TypeError, InputError):
            value = kind(text)
            if allowed(value):
                return value
        raise argparse.ArgumentTypeError(f"must be {words}, got {shown(text)}")

    return parse


def several(kind: Callable[[str], Any]) -> Callable[[str], list]:
    """Type of an option that is a comma-separated list of a type, without repetitions."""

    def parse(text):
        try:
            values = [kind(part) for part in text.split(",")]
        except InputError as error:
            # Argparse would put words of its own in its place.
            raise argparse.ArgumentTypeError(str(error)) from None
        if len(set(values)) < len(values):
            raise argparse.ArgumentTypeError(f"must not name a value twice, got {shown(text)}")
        return values

    return parse


def parser(
    name: str,
    description: str | None,
    drivers: Sequence[str] = (),
    settings: Settings = MappingProxyType({}),
    folder: str | None = None,
    **defaults: Any,
) -> Parser:
    """Parser with the options every experiment has; drivers: to choose from, where there are."""
    options = bare_parser(name, description)
    options.add_argument(
        "--quick", action="store_true", help="a smaller job, in a folder of its own"
    )
    options.add_argument("--json", action="store_true", help="print summary.json and nothing else")
    add_out(options, name if folder is None else folder)
    options.add_argument("--arch", default="cpu", choices=runtime.ARCHITECTURES)
    if drivers:
        options.add_argument("--driver", default=drivers[0], choices=drivers)
    options.add_argument("--threads", type=whole(1, 1024), default=None, help="CPU threads")
    options.settings = settings
    for name, (_, _, *option) in settings.items():
        if option:
            kind, words = option
            words = words.replace("%", "%%")
            options.add_argument(f"--{name.replace('_', '-')}", type=kind, help=words)
    options.set_defaults(**defaults)
    return options


def bare_parser(name: str, description: str | None) -> Parser:
    """Parser of a script with the one option that every script has."""
    plain: Any = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
    options = Parser(prog=f"python experiments/{name}.py", description=description, **plain)
    options.add_argument("--quiet", action="store_true", help="print nothing but errors")
    options.add_argument("--verbose", action="store_true", help="print all figures of a run")
    return options


def add_out(made: Parser, folder: str) -> None:
    """Add the option --out; folder: by default, below results, or results/quick with --quick."""
    made.folder = folder
    place, smaller = Path("results", folder), Path("results", "quick", folder)
    words = f"folder for the output; default {place}, with --quick {smaller}"
    made.add_argument("--out", type=os.path.expanduser, help=words)


def _take_settings(options: Namespace, settings: Settings) -> None:
    """Give each setting that no option has set its value in the full or in the quick job."""
    for name, (full, quick, *_) in settings.items():
        if getattr(options, name, None) is None:
            setattr(options, name, quick if options.quick else full)


def begin(options: Namespace, settings: Settings = MappingProxyType({})) -> Path:
    """Take settings that ``main`` does not know; make the folder for the output."""
    _take_settings(options, settings)
    return Path(output_folder(options.out))


def output_paths(folder: str) -> Callable[[str], str]:
    """Make the folder of the output; returns a function: path of a file in it, by its name."""
    return functools.partial(os.path.join, output_folder(folder))


def add_pictures(made: ArgumentParser) -> None:
    """Add the options that choose pictures: options.pictures is "key", "all" or "no"."""
    chosen = made.add_mutually_exclusive_group()
    for name, words in {"all": "draw further pictures", "no": "draw no pictures"}.items():
        what: Any = {"dest": "pictures", "action": "store_const", "const": name, "default": "key"}
        chosen.add_argument(f"--{name}-pictures", help=words, **what)


def add_checkpoints(made: ArgumentParser) -> None:
    """Add the options of a job that saves itself; see ``checkpoint_of``."""
    words = "save the run every 600s of wall time, 5000steps or 1e-5sim of simulated seconds"
    made.add_argument("--checkpoint-every", type=interval, default={}, help=words)
    words = "resume the run that was saved in the same --out"
    made.add_argument("--resume", action="store_true", help=words)


def checkpoint_of(options: Namespace, name: str = "run", *, may_be_new: bool = False) -> dict:
    """Arguments checkpoint and resume of a job: its file is out/name.checkpoint."""
    path = os.path.join(options.out, f"{name}.checkpoint")
    checkpoint = Checkpoint(**{**options.checkpoint_every, "path": path})
    goes_on = options.resume and (os.path.exists(path) or not may_be_new)
    return {"checkpoint": checkpoint, "resume": path if goes_on else None}


def add_accuracy(made: ArgumentParser, what: str, source: str) -> None:
    """Add the options --accuracy and --budget."""
    words = f"find {what} with an error of this share of the value, such as 1%%; do nothing else"
    made.add_argument("--accuracy", type=tolerance, default=None, help=words)
    words = f"with --accuracy, also measure the error of this source: {source}"
    made.add_argument("--budget", choices=(source,), help=words)


def accuracy_sources(options: Namespace) -> list[str]:
    """Sources of error that --accuracy and --budget ask for."""
    return ["step", options.budget] if options.budget else ["step"]


def check_accuracy(options: Namespace, others: Iterable[str] = ()) -> None:
    """Raise InputError where --accuracy was given with what leaves it no choice."""
    given = [name for name in ("resume", "checkpoint_every", *others) if getattr(options, name)]
    if given:
        names = " and ".join(name.replace("_", "-") for name in given)
        raise InputError(f"accuracy must be left out with {names}: it chooses runs of its own")


def main(
    run: Callable[[Namespace], None],
    made: Parser,
    arguments: Sequence[str] | None = None,
) -> int:
    """Parse, say what is done, start Taichi, run; returns the exit code of ``exit_code``."""
    given = sys.argv[1:] if arguments is None else arguments

    def work(options):
        if getattr(options, "budget", None) and options.accuracy is None:
            raise InputError(f"budget must be left out without --accuracy, got {options.budget}")
        _take_settings(options, made.settings)
        options.started = time.perf_counter()
        options.entry = made.entry or entry_of(run)
        options.command = [*made.prog.split()[1:], *given]
        runtime.start(options.arch, options.threads)
        show_opening(made.description, options.entry, options.quick)
        run(options)
        older = older_files(options.out, options.began)
        if older:
            print(f"Files of earlier runs in {options.out}: {', '.join(older)}")
        return 0

    return main_of_tool(work, made, arguments)


def main_of_tool(
    work: Callable[[Namespace], int | None],
    made: Parser,
    arguments: Sequence[str] | None = None,
) -> int:
    """Parse and do work(options), as loud as --quiet and --json say; as ``exit_code``."""

    def heard():
        options = made.parse_args(arguments)
        options.began = time.time()
        if options.out is None:
            # A smaller job leaves the results of the full one as they are.
            options.out = str(Path("results", "quick" if options.quick else "", made.folder))
        with _loudness(options):
            code = work(options)
        if getattr(options, "json", False):
            print(_summary(options))
        return code

    return exit_code(heard)


@contextlib.contextmanager
def _loudness(options):
    """Discard prints in the block for --json and --quiet, for --quiet also bars and warnings."""
    with contextlib.ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        warnings.showwarning = functools.partial(_show_warning, warnings.showwarning)
        if options.quiet or getattr(options, "json", False):
            nowhere = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
            stack.enter_context(contextlib.redirect_stdout(nowhere))
        if options.quiet:
            warnings.simplefilter("ignore")
        stack.enter_context(showing(not options.quiet))
        yield


def _show_warning(usual, message, category, *place, **more):
    """Show a warning about a scene as a sentence, without the line of code that gave it."""
    if category is UserWarning:
        print(f"warning: {message}", file=sys.stderr)
    else:
        usual(message, category, *place, **more)


def _summary(options):
    """Text of summary.json, without the newline at its end."""
    path = Path(options.out, "summary.json")
    if not path.is_file() or path.name in older_files(options.out, options.began):
        raise InputError(f"json needs a run that writes {path.name}, but this run wrote none")
    return path.read_text(encoding="utf-8").rstrip()


def exit_code(work: Callable[[], int | None]) -> int:
    """Exit code of a program that does work(): 0 done, or what work returns."""
    # 0 done, 2 bad input, 3 diverged, 130 Ctrl-C, 128 + number of another signal. Files are written
    # even if the reader of the output has left (``| head -1``).
    with lasting_output():
        try:
            with ending_children():
                return work() or 0
        except (InputError, SimulationDiverged) as error:
            code, words = (2 if isinstance(error, InputError) else 3), str(error)
        except Interrupted as error:
            code, words = 128 + error.number, f"{error}: continue with --resume"
        except KeyboardInterrupt:
            code, words = 130, "interrupted"
        except Terminated as error:
            code, words = 128 + error.number, f"ended by {signal.Signals(error.number).name}"
        print(" ".join(words.split()), file=sys.stderr, flush=True)
        return code
