"""The frame of the attacks: seeds are drawn, failures counted, and the table says what happened."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.attacks import BEGIN, END, class_of, table_rows, write_table
from tests.processes import users_environment
from tests.scenes import ROOT

PAGE = f"Before.\n\n{BEGIN}\n{END}\n\nAfter.\n"
GOOD = """
ATTACKS = "numbers"

def test_drawn(seed):
    assert seed >= 3

def test_once():
    pass
"""
BAD = """
import os
import pytest

ATTACKS = "processes"

def test_sometimes(seed):
    assert seed != 4

def test_left_out():
    pytest.skip("not here")

@pytest.mark.xfail
def test_known_limit():
    assert False
"""
FATAL = """
import os

ATTACKS = "crashes"

def test_dies(seed):
    if seed == 3:
        os._exit(11)
"""


def attacked(folder, *options, **modules):
    """Run attacks in a folder; returns the exit code and the page."""
    for name, text in modules.items():
        (folder / f"test_{name}.py").write_text(text)
    page = folder / "page.md"
    page.write_text(PAGE)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.attacks", f"--rootdir={folder}"]
    command += ["-p", "no:cacheprovider", "-c", "/dev/null", str(folder), *options]
    command += ["--attack-table", str(page), "--attack-seed", "3"]
    environment = users_environment(PYTHONPATH=str(ROOT))
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    return done, page.read_text()


def test_a_failing_attack_is_in_the_table_and_in_the_exit_code(tmp_path):
    done, page = attacked(tmp_path, "--attacks", "3", good=GOOD, bad=BAD)
    assert done.returncode == 1, done.stdout
    # The skipped attack has not been tried, the known limit has not been survived.
    assert dict(table_rows(page)) == {"numbers": (4, 4), "processes": (4, 2)}
    assert "| together | 8 | 6 |" in page and "seeds 3 to 5." in page
    assert page.startswith("Before.\n") and page.endswith("\nAfter.\n")


def test_a_process_that_dies_is_counted(tmp_path):
    done, page = attacked(tmp_path, "--attacks", "2", "-n", "1", fatal=FATAL, good=GOOD)
    assert done.returncode == 1, done.stdout
    assert dict(table_rows(page)) == {"crashes": (2, 1), "numbers": (3, 3)}


def test_no_attack_is_begun_when_the_time_is_over(tmp_path):
    done, page = attacked(tmp_path, "--attack-minutes", "0", good=GOOD)
    assert done.returncode == 0 and "2 skipped" in done.stdout
    assert page == PAGE


def test_a_page_without_a_place_for_the_table_is_refused(tmp_path):
    options = ("--attack-table", str(tmp_path / "none.md"))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.attacks", *options]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 4 and "must be a page" in done.stderr


def test_classes_that_were_not_attacked_keep_their_rows(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    write_table(page, {"files": (5, 4), "numbers": (7, 7)}, range(5))
    write_table(page, {"files": (6, 6)}, range(5, 9))
    assert dict(table_rows(page.read_text())) == {"files": (6, 6), "numbers": (7, 7)}
    assert page.read_text().count("Last run") == 1
    with pytest.raises(pytest.UsageError, match=BEGIN):
        write_table(tmp_path / "none.md", {}, range(1))


def test_every_module_names_its_class_and_every_row_of_the_page_is_one():
    classes = {class_of(file) for file in Path(ROOT, "tests/attack").glob("test_*.py")}
    assert None not in classes
    page = Path(ROOT, "docs/reliability.md").read_text(encoding="utf-8")
    assert {title for title, _ in table_rows(page)} <= classes
