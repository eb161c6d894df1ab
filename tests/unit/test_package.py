"""The wheel carries all files of both packages and runs where it is only unpacked."""

import shutil
import subprocess
import sys
import zipfile

import pytest

from tests.docs.pages import FOLDER
from tests.processes import users_environment

SOURCES = ("taichi_dem", "ca_damper", "pyproject.toml", "README.md", "LICENSE")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, made without the network of nothing but its sources."""
    folder = tmp_path_factory.mktemp("wheel")
    ignored = shutil.ignore_patterns("__pycache__")
    for name in SOURCES:
        if (FOLDER / name).is_file():
            shutil.copy(FOLDER / name, folder / name)
        else:
            shutil.copytree(FOLDER / name, folder / name, ignore=ignored)
    line = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--no-index"]
    line += ["--no-deps", "--no-build-isolation", "--wheel-dir", "made", "."]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    (path,) = (folder / "made").glob("*.whl")
    return zipfile.ZipFile(path)


def test_the_wheel_carries_all_files_of_both_packages_and_no_others(wheel):
    expected = {
        path.relative_to(FOLDER).as_posix()
        for package in ("taichi_dem", "ca_damper")
        for path in (FOLDER / package).rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    assert {name for name in wheel.namelist() if ".dist-info/" not in name} == expected


def test_what_is_unpacked_runs_and_reads_its_own_mesh(wheel, tmp_path):
    wheel.extractall(tmp_path / "unpacked")
    text = "import ca_damper, taichi_dem as t; print(t.__file__, t.read_mesh(t.PAPER_BLOCK).source)"
    options = {"capture_output": True, "text": True, "cwd": tmp_path}
    environment = users_environment(PYTHONPATH=str(tmp_path / "unpacked"))
    done = subprocess.run([sys.executable, "-c", text], env=environment, **options)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    for path in done.stdout.split():
        assert path.startswith(str(tmp_path / "unpacked"))


def test_libraries_of_pictures_and_mesh_files_are_imported_where_they_are_used():
    """They take half of a second, of a program that draws nothing too."""
    named = "import blast_fracture, demo_damper, sys"
    text = f"{named}; print(*{{'matplotlib', 'PIL', 'meshio'}} & {{*sys.modules}})"
    options = {"capture_output": True, "text": True, "cwd": FOLDER / "experiments"}
    environment = users_environment(PYTHONPATH=str(FOLDER))
    done = subprocess.run([sys.executable, "-c", text], env=environment, **options)
    assert (done.stdout, done.stderr) == ("\n", "")
