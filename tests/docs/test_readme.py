"""The first page: its scenes run as they stand, its table and its pictures are those there are."""

import csv
import inspect
import json
import re
from pathlib import Path

import meshio
import pytest

import taichi_dem
from gallery import SMALL_PICTURES, pages, renew_readme
from taichi_dem.kit.study.results_page import markdown_table
from tests.docs.pages import FOLDER, PAGES, blocks, links, run_pasted, words

README = FOLDER / "README.md"
MOST_LINES = 20
MOST_BYTES = 3_000_000


def readme_table():
    """The table of all experiments."""
    return markdown_table(pages(), FOLDER, SMALL_PICTURES)


def test_the_scenes_are_short_and_all_run_below():
    """One of each package."""
    assert [len(text.splitlines()) <= MOST_LINES for text in blocks("README.md")] == [True] * 2


def test_the_blast_runs_and_leaves_what_the_page_says(tmp_path):
    run_pasted(blocks("README.md")[0], tmp_path)
    mine = tmp_path / "results" / "mine"
    for name in ("history.csv", "bonds.csv", "mesh.msh", "report.json", "paraview/mine.pvd"):
        assert (mine / name).is_file(), name
    report = json.loads((mine / "report.json").read_text(encoding="utf-8"))
    assert report["broken_faces"] > 0 and not report["needs"]
    # The cell values that docs/paraview.md lists are those of the last snapshot.
    last = meshio.read(sorted((mine / "paraview").glob("*.vtu"))[-1])
    page = words("docs/paraview.md")
    assert len(last.cell_data) == 6 + 2 * 5
    assert all(name in page for name in last.cell_data)


def test_the_damper_runs_and_both_fillings_agree(tmp_path):
    """30 grains of 0.2 g pull the peak down as a rigid mass does: sqrt(86 / 92) f0 = 0.967.

    Within the 0.01 by which the ratios are apart.
    """
    said = run_pasted(blocks("README.md")[1], tmp_path).said
    peaks = dict(re.findall(r"^(\w+): peak at ([\d.]+) f0", said, re.MULTILINE))
    assert list(peaks) == ["ca_place", "dem"]
    for label, ratio in peaks.items():
        assert float(ratio) == pytest.approx((86.0 / 92.0) ** 0.5, abs=0.01)
        with open(tmp_path / f"{label}.csv", newline="") as rows:
            assert len(list(csv.DictReader(rows))) == 4


def test_the_long_run_goes_on_from_its_checkpoint(tmp_path):
    """The start, the 200 samples of the first run, and those of the second half of 200."""
    wanted = "list(result.history['time_s']), result.report.needs"
    ran = run_pasted(blocks("docs/long_runs.md")[0], tmp_path, wanted)
    times, needs = ran.left
    # The observer is called in the second half only.
    assert re.findall(r"^(\S+) s: fastest body", ran.said, re.MULTILINE) == ["1.5e-03", "2.0e-03"]
    assert len(times) == 1 + 200 + 100 and times[-1] == pytest.approx(2e-3)
    assert not needs and (tmp_path / "run.npz").is_file()


@pytest.mark.slow
def test_the_example_in_the_docstring_runs(tmp_path):
    """Its shorter sister is the first scene of the page."""
    (text,) = re.findall(r"::\n\n(.+?)\n\n(?=\S)", taichi_dem.__doc__, re.DOTALL)
    assert "0 of 1688 bonds broken" in run_pasted(inspect.cleandoc(text), tmp_path).said


def test_the_table_is_that_of_the_gallery():
    text = README.read_text(encoding="utf-8")
    assert readme_table() in text, "renew it: python experiments/gallery.py --readme"


def test_renewing_writes_the_table_and_shows_what_is_there(tmp_path):
    """A picture that is there leaves its comment; the rest stays, and once is enough."""
    (tmp_path / "there.png").touch()
    places = "<!-- ![One](there.png) -->\n<!-- ![Two](not_there.png) -->\n"
    page = tmp_path / "README.md"
    page.write_text(f"Before\n\n| question | old |\n|---|---|\n| a | b |\n\nAfter\n{places}")
    for _ in range(2):
        renew_readme(tmp_path)
        expected = f"Before\n\n{readme_table()}\nAfter\n![One](there.png)\n"
        assert page.read_text() == f"{expected}<!-- ![Two](not_there.png) -->\n"


def test_every_picture_is_shown_or_linked():
    """One whose place was kept in a comment is shown by: python experiments/gallery.py --readme."""
    used = {Path(link).name for page in PAGES for link in links(page)}
    there = {path.name for path in (FOLDER / SMALL_PICTURES).iterdir() if path.suffix != ".md"}
    assert there <= used, sorted(there - used)


def test_pictures_in_the_repository_are_small():
    sizes = [path.stat().st_size for path in (FOLDER / SMALL_PICTURES).iterdir()]
    assert sum(sizes) < MOST_BYTES and max(sizes) < MOST_BYTES / 10


def test_pictures_that_are_not_there_yet_are_named_in_a_comment():
    """A place for a picture breaks nothing, and is ready to be used."""
    text = README.read_text(encoding="utf-8")
    for line in re.findall(r"<!--(.*?)-->", text, re.DOTALL):
        for name in re.findall(r"!\[[^]]+\]\((.+?)\)", line):
            assert not (FOLDER / name).exists(), f"{name} is there: gallery.py --readme shows it"
