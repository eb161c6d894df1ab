"""Figures in the sentences of pages are those of the runs whose pictures the pages show."""

import json
import re

import pytest

from _figures_in_text import KEPT, fill_figures, in_digits, keep_figures
from taichi_dem import InputError
from tests.docs.pages import FOLDER, PAGES

#: Pages whose measured figures in these units all come from kept figures.
WHOLE = {"README.md": "s|kJ|MB|times", "docs/limits.md": "kJ|MB|times"}
MARK = "<!-- figure: {}, 2 digits -->{}<!-- end -->"


@pytest.mark.parametrize("page", [page for page in PAGES if page != "CHANGELOG.md"])
def test_figures_are_those_kept(page):
    text = (FOLDER / page).read_text(encoding="utf-8")
    assert fill_figures(text, FOLDER) == text, "renew them: experiments/gallery.py --readme"


@pytest.mark.parametrize("page", WHOLE)
def test_no_measured_figure_is_typed(page):
    """Tables and blocks apart: their times are those of the gallery's texts."""
    text = (FOLDER / page).read_text(encoding="utf-8")
    text = re.sub(r"```.*?```|^ *\|.*?$|<!-- figure.*?end -->", "", text, flags=re.DOTALL | re.M)
    assert not re.findall(rf"[^\n]*\d (?:{WHOLE[page]})\b[^\n]*", text)


def summary(tmp_path, quick, **figures):
    folder = tmp_path / "results" / "demo_x"
    folder.mkdir(parents=True, exist_ok=True)
    made = {key: {"value": value} for key, value in figures.items()}
    kept = {"figures": made, "quick": quick, "command": "x", "machine": {}, "versions": {}}
    (folder / "summary.json").write_text(json.dumps(kept))
    return tmp_path / "results"


def test_a_new_full_run_changes_the_sentence_and_a_quick_one_does_not(tmp_path):
    (tmp_path / "docs").mkdir()
    for quick, told in ((False, "0.25"), (True, "0.25")):
        results = summary(tmp_path, quick, seconds=1.0 + quick, steps=4)
        keep_figures(results, tmp_path, ["demo_x", "demo_y"])
        text = f"takes {MARK.format('demo_x.seconds / demo_x.steps', 'old')} s"
        assert fill_figures(text, tmp_path) == text.replace("old", told)
    assert set(json.loads((tmp_path / KEPT).read_text())) == {"demo_x"}


@pytest.mark.parametrize("formula", ["demo_x.seconds", "nobody.steps", "steps"])
def test_a_figure_that_no_run_has_kept_is_named(tmp_path, formula):
    (tmp_path / "docs").mkdir()
    keep_figures(summary(tmp_path, False, steps=4), tmp_path, ["demo_x"])
    with pytest.raises(InputError, match=re.escape(repr(formula))):
        fill_figures(MARK.format(formula, 1), tmp_path)


@pytest.mark.parametrize(
    ("value", "digits", "words"),
    [
        (0.0123, 1, "0.01"),
        (8.46, 2, "8.5"),
        (123.4, 2, "120"),
        (2702.0, 2, "2,700"),
        (9.96, 2, "10"),
    ],
)
def test_digits_are_those_of_a_sentence(value, digits, words):
    assert in_digits(value, digits) == words
