"""Every command of the pages runs when pasted into a new shell after the two of the set-up."""

import importlib
import re
import shlex
import subprocess
import sys
from importlib.metadata import distribution

import pytest

from taichi_dem import InputError
from tests.docs.pages import FOLDER, PAGES, tokens
from tests.processes import users_environment

#: First words of a command line; others are names, options or files.
PROGRAMS = re.compile(r"(\./)?(make|python3?|pip3?|pytest|taichi-dem|ca-damper|dask|pvpython)\b.")
HERE = re.compile(r"\.(venv/bin|ci)/\w+")
#: What the history of the project says is no command to paste.
READ = [page for page in PAGES if page != "CHANGELOG.md"]
#: Programs that come with an extra or with ParaView, which their pages say.
BROUGHT = {"docs/sweeps.md": {"dask"}, "docs/paraview.md": {"pvpython"}}
INSTALLED = distribution("taichi-dem")


def lines_of(page):
    """What a page lets a reader paste: lines of blocks for the shell, and code inside of lines."""
    for token in tokens(page):
        if token.type == "fence" and token.info.strip() in ("", "sh"):
            yield from token.content.splitlines()
        elif token.type == "code_inline":
            yield token.content


COMMANDS = [
    (page, *shlex.split(line, comments=True))
    for page in READ
    for line in lines_of(page)
    if PROGRAMS.match(line) or HERE.match(line)
]


def is_made(words):
    """Whether make knows what to do; it is not done."""
    done = subprocess.run(["make", "-n", *words], cwd=FOLDER, capture_output=True)
    return done.returncode == 0


def script_takes(script, words):
    """Whether a script of the repository is there and takes the words that follow its name."""
    if script.stem == "NAME":
        return script.parent.is_dir()
    if not script.is_file():
        return False
    module = importlib.import_module(script.stem)
    if hasattr(module, "options_parser"):
        try:
            module.options_parser().parse_args(words)
        except InputError:
            return False
        return True
    line = [sys.executable, str(script), "--help"]
    told = subprocess.run(line, capture_output=True, text=True, env=users_environment()).stdout
    return all(word in told for word in words)


def python_runs(words):
    """Whether Python finds what it is asked to run: a script with its options, or a module."""
    if not words:
        return True
    if words[0] != "-m":
        return script_takes(FOLDER / words[0], words[1:])
    extras = re.findall(r"\.\[(\w+)\]", words[-1]) if words[1:3] == ("pip", "install") else []
    unknown = set(extras) - set(INSTALLED.metadata.get_all("Provides-Extra"))
    return importlib.util.find_spec(words[1]) is not None and not unknown


def runs(page, program, *words):
    """Whether a command finds its program, and the program what it names, without activation."""
    name = program.rsplit("/", 1)[-1]
    if name in BROUGHT.get(page, ()):
        return True
    if program == "make":
        return is_made(words)
    if program == ".venv/bin/python":
        return python_runs(words)
    if program.startswith(".venv/bin/"):
        return name in INSTALLED.entry_points.names
    return program == ".ci/run"


@pytest.mark.parametrize("command", COMMANDS, ids=lambda one: " ".join(one))
def test_a_pasted_command_runs(command):
    assert runs(*command), f"{command[0]}: {shlex.join(command[1:])}"


def test_commands_that_fail_are_noticed():
    for line in (
        "python experiments/demo_damper.py",
        "pip install taichi-dem",
        "make no_such_target",
        ".venv/bin/python experiments/demo_damper.py --no-such-option",
        ".venv/bin/python experiments/no_such_file.py",
        ".venv/bin/python -m no_such_module",
        ".venv/bin/python -m pip install -e '.[no_such_extra]'",
        ".venv/bin/no_such_program",
    ):
        assert not runs("README.md", *shlex.split(line)), line
