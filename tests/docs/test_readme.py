"""The first page: its scenes run as they stand, its table and its pictures are those there are."""

import csv
import re
from pathlib import Path

import meshio
import pytest

from _gallery_pages import SMALL_PICTURES, readme_table
from taichi_dem import runtime
from tests.docs.pages import FOLDER, PAGES, blocks, links, run_block, words
from tests.scenes import ROOT

README = FOLDER / "README.md"
MOST_LINES = 20
MOST_BYTES = 3_000_000


@pytest.fixture
def left_by(tmp_path, monkeypatch):
    """``left_by(k)``: names that the k-th Python block of the page leaves, run in a folder."""

    def run(k):
        runtime.stop()
        (tmp_path / "experiments").symlink_to(Path(ROOT) / "experiments")
        monkeypatch.chdir(tmp_path)
        return run_block(blocks("README.md")[k], tmp_path)

    return run


def test_the_scenes_are_short():
    assert [len(text.splitlines()) <= MOST_LINES for text in blocks("README.md")] == [True, True]


def test_the_blast_runs_and_leaves_what_the_page_says(left_by, tmp_path):
    report = left_by(0)["result"].report
    assert report.broken_faces > 0 and not report.needs
    mine = tmp_path / "results" / "mine"
    for name in ("history.csv", "mesh.msh", "report.json", "paraview/blast.pvd"):
        assert (mine / name).is_file(), name
    # The cell values that docs/paraview.md lists are those of the last snapshot.
    last = meshio.read(sorted((mine / "paraview").glob("*.vtu"))[-1])
    page = words("docs/paraview.md")
    assert len(last.cell_data) == 6
    assert all(name in page for name in last.cell_data)


def test_the_damper_runs_and_both_fillings_agree(left_by, tmp_path):
    """30 grains of 0.2 g pull the peak down as a rigid mass does: sqrt(86 / 92) f0 = 0.967.

    Within the 0.01 by which the ratios are apart.
    """
    left = left_by(1)
    assert left["filling"].label == "dem"
    assert left["ratio"][0, 0] == pytest.approx((86.0 / 92.0) ** 0.5, abs=0.01)
    for label in ("dem", "ca_static"):
        with open(tmp_path / f"{label}.csv", newline="") as rows:
            assert len(list(csv.DictReader(rows))) == 4


def test_the_table_is_that_of_the_gallery():
    text = README.read_text(encoding="utf-8")
    assert readme_table() in text, (
        "README.md has another table than `python experiments/gallery.py --table` prints"
    )


def test_every_picture_is_shown_or_linked():
    """One that a colleague adds has its place in README.md in a comment: take it out of that."""
    used = {Path(link).name for page in PAGES for link in links(page)}
    there = {path.name for path in (FOLDER / SMALL_PICTURES).iterdir()}
    assert there <= used, sorted(there - used)


def test_pictures_in_the_repository_are_small():
    sizes = [path.stat().st_size for path in (FOLDER / SMALL_PICTURES).iterdir()]
    assert sum(sizes) < MOST_BYTES and max(sizes) < MOST_BYTES / 10


def test_pictures_that_are_not_there_yet_are_named_in_a_comment():
    """A place for a picture breaks nothing, and is ready to be used."""
    text = README.read_text(encoding="utf-8")
    for line in re.findall(r"<!--(.*?)-->", text, re.DOTALL):
        for name in re.findall(r"!\[[^]]+\]\((.+?)\)", line):
            assert not (FOLDER / name).exists(), f"{name} is there: take it out of the comment"
