"""A bad command line of any experiment is one sentence and exit code 2, and writes nothing."""

import importlib
import os
from pathlib import Path

import pytest

from taichi_dem import InputError
from taichi_dem.kit import study
from tests.scenes import ROOT

EXPERIMENTS = [
    path.stem
    for path in sorted(Path(ROOT, "experiments").glob("[a-z]*.py"))
    if "def options_parser" in path.read_text(encoding="utf-8")
]
#: What no option that is checked can mean.
BAD = ("nonsense", "", "nan", "1e999")
#: Lists of words, which are checked where they are used.
LATER = ("--only", "--fillings")
#: Lines that are checked later than their options, of which one experiment stands for all.
LINES = {
    "output in a file": ("--out", "{file}/below"),
    "no such option": ("--nonsense",),
    "mesh that is no file": ("--mesh", "{folder}"),
    "effect that is not there": ("--with", "dust"),
    "answer to an accuracy by a step": ("--accuracy", "1%", "--dt0", "1e-7"),
    "checkpoint too often": ("--until", "0.9", "--dt0", "1e-9", "--checkpoint-every", "1steps"),
}


def is_checked(action):
    """Whether an option takes a word of which not all are right."""
    free = action.type in (None, str, os.path.expanduser) and action.choices is None
    return not free and action.nargs != 0 and action.option_strings[-1] not in LATER


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_an_option_refuses_what_it_cannot_mean(name):
    parser = importlib.import_module(name).options_parser()
    for option in [one.option_strings[-1] for one in parser._actions if is_checked(one)]:
        for text in BAD:
            with pytest.raises(InputError) as refusal:
                parser.parse_args([option, text])
            assert option in str(refusal.value) and "\n" not in str(refusal.value)


@pytest.mark.parametrize("case", LINES)
def test_a_bad_line_ends_with_exit_code_2_and_writes_nothing(case, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("x")
    places = {"file": tmp_path / "file", "folder": tmp_path}
    line = [word.format(**places) for word in LINES[case]]
    script = importlib.import_module("blast_fracture")
    code = study.main(script.run, script.options_parser(), ["--out", "out", *line])
    said = capsys.readouterr().err
    assert code == 2 and said.endswith("\n") and said.count("\n") == 1
    assert os.listdir(tmp_path) == ["file"]


@pytest.mark.parametrize(
    "line, close",
    [
        ("--methdo fixed", "--method"),
        ("--method fixd", "fixed"),
        ("--xyzzy 1", None),
        ("--method qq", None),
    ],
)
def test_a_wrong_word_is_answered_with_the_one_it_resembles(line, close):
    parser = importlib.import_module("blast_fracture").options_parser()
    with pytest.raises(InputError) as refusal:
        parser.parse_args(line.split())
    assert str(refusal.value).partition("did you mean ")[2] == (f"{close}?" if close else "")
