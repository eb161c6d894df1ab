"""--quiet and --json of every program, and what each says before it begins."""

import json
import os
import subprocess
import sys
import warnings

import pytest

from gallery import TOOLS
from taichi_dem import InputError
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study.entries import entry_of
from taichi_dem.kit.study.look import show_opening
from tests import arch
from tests.experiments.contract import FOLDER, NAMES
from tests.processes import users_environment

SCRIPTS = sorted(path.stem for path in FOLDER.glob("[a-z]*.py"))


@pytest.mark.parametrize("name", SCRIPTS)
def test_every_program_can_be_quiet_and_every_experiment_speaks_json(script, name):
    module = script(name)
    if not hasattr(module, "options_parser"):
        assert name in TOOLS
        line = [sys.executable, str(FOLDER / f"{name}.py"), "--help"]
        options = {"capture_output": True, "text": True, "env": users_environment()}
        assert "--quiet" in subprocess.run(line, **options).stdout
        return
    made = module.options_parser()
    for line in ([], ["--quiet"], ["--json"], ["--quiet", "--json"]):
        options = made.parse_args(line)
        assert (options.quiet, options.json) == ("--quiet" in line, "--json" in line)


@pytest.mark.parametrize("name", NAMES)
def test_every_experiment_says_what_it_asks_and_how_long_it_takes(script, capsys, name):
    module = script(name)
    entry, made = entry_of(module.run), module.options_parser()
    show_opening(made.description, entry)
    first, second = capsys.readouterr().out.splitlines()[:2]
    assert first.endswith("?") and second.startswith("Takes about ")
    assert entry.time.split()[-1] in second or entry.time.startswith("about")
    show_opening(made.description, entry, quick=True)
    assert entry.quick in capsys.readouterr().out.splitlines()[1]


def loud(options):
    """A study that speaks in every way there is, and writes what one writes."""
    print("a line")
    with ProgressBar("a bar") as bar:
        bar.at(0.5)
    warnings.warn("a warning", stacklevel=1)
    print("of an error", file=sys.stderr)
    write_text(os.path.join(options.out, "summary.json"), json.dumps({"figures": {}}))


@pytest.fixture
def ended(tmp_path, capsys):
    """``ended(run, *options)``: exit code, standard output and standard error."""

    def start(run, *options):
        made = study.parser("none", "What for?")
        given = ["--threads", "2", "--arch", arch.chosen(), "--out", str(tmp_path), *options]
        code = study.main(run, made, given)
        return code, *capsys.readouterr()

    return start


@pytest.mark.filterwarnings("always")
def test_json_is_the_summary_and_nothing_else(ended):
    errors = "warning: a warning\nof an error\n"
    assert ended(loud, "--json") == (0, '{"figures": {}}\n', errors)


def test_quiet_leaves_errors_alone(ended):
    assert ended(loud, "--quiet") == (0, "", "of an error\n")
    assert ended(loud, "--quiet", "--json") == (0, '{"figures": {}}\n', "of an error\n")


@pytest.mark.filterwarnings("always")
def test_a_warning_is_a_sentence_unless_it_is_of_other_code(ended):
    code, said, errors = ended(loud)
    assert code == 0 and said.splitlines()[0] == "What for?"
    assert "warning: a warning\n" in errors and __file__ not in errors
    with pytest.warns(RuntimeWarning, match="of a library"):
        ended(lambda _: warnings.warn("of a library", RuntimeWarning, stacklevel=1))


@pytest.mark.parametrize("options", [["--quiet"], ["--json"]])
def test_an_error_is_one_sentence_and_no_document(ended, options):
    def refuse(_):
        print("a line")
        raise InputError("until must be 1, got 2")

    assert ended(refuse, *options) == (2, "", "until must be 1, got 2\n")


def test_a_summary_of_an_earlier_run_is_not_passed_on(ended, tmp_path):
    (tmp_path / "summary.json").write_text("{}")
    os.utime(tmp_path / "summary.json", (1.0, 1.0))
    sentence = "json needs a run that writes summary.json, and this one wrote none\n"
    assert ended(lambda _: None, "--json") == (2, "", sentence)
