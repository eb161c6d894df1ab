"""The wheel: what it carries, and that it runs where it is only unpacked; one version for all."""

import configparser
import email
import importlib.metadata
import json
import pkgutil
import re
import shutil
import subprocess
import sys
import zipfile

import pytest

import ca_damper
import taichi_dem
from taichi_dem import PAPER_BLOCK
from taichi_dem.kit import study
from taichi_dem.kit.checkpoint import version_text
from tests import arch
from tests.docs.pages import FOLDER
from tests.processes import users_environment

SOURCES = ("taichi_dem", "ca_damper", "pyproject.toml", "README.md", "LICENSE")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, made without the network of nothing but its sources."""
    folder = tmp_path_factory.mktemp("wheel")
    ignored = shutil.ignore_patterns("__pycache__")
    for name in SOURCES:
        copy = shutil.copy if (FOLDER / name).is_file() else shutil.copytree
        options = {} if (FOLDER / name).is_file() else {"ignore": ignored}
        copy(FOLDER / name, folder / name, **options)
    line = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--no-index"]
    line += ["--no-deps", "--no-build-isolation", "--wheel-dir", "made", "."]
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    (path,) = (folder / "made").glob("*.whl")
    return zipfile.ZipFile(path)


@pytest.fixture(scope="module")
def unpacked(wheel, tmp_path_factory):
    """Where the wheel is unpacked, by no installer."""
    folder = tmp_path_factory.mktemp("unpacked")
    wheel.extractall(folder)
    return folder


def about(wheel):
    """Metadata of the wheel."""
    (name,) = [name for name in wheel.namelist() if name.endswith(".dist-info/METADATA")]
    return email.message_from_string(wheel.read(name).decode())


def said(folder, tmp_path, *arguments):
    """What Python prints, in another folder, where packages are found in this one first."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=tmp_path,
        env=users_environment(PYTHONPATH=str(folder)),
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return done.stdout


def test_the_wheel_carries_all_files_of_both_packages_and_no_others(wheel):
    expected = {
        path.relative_to(FOLDER).as_posix()
        for package in ("taichi_dem", "ca_damper")
        for path in (FOLDER / package).rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    assert {name for name in wheel.namelist() if ".dist-info/" not in name} == expected
    assert {"taichi_dem/py.typed", "ca_damper/py.typed"} <= expected
    with open(PAPER_BLOCK, "rb") as mesh:
        assert wheel.read("taichi_dem/meshes/paper_block.msh") == mesh.read()


def test_the_wheel_says_what_it_is(wheel):
    fields = about(wheel)
    assert fields["Version"] == taichi_dem.__version__ == ca_damper.__version__
    assert fields["Author"] == "The taichi-dem developers"
    assert fields["License-Expression"] == "MIT"
    assert fields["Description-Content-Type"] == "text/markdown"
    assert fields.get_payload().strip() == (FOLDER / "README.md").read_text("utf-8").strip()
    (licence,) = [name for name in wheel.namelist() if name.endswith("/LICENSE")]
    assert wheel.read(licence) == (FOLDER / "LICENSE").read_bytes()


def test_the_wheel_has_a_program_for_each_package_and_needs_no_tests(wheel):
    (name,) = [name for name in wheel.namelist() if name.endswith("/entry_points.txt")]
    entries = configparser.ConfigParser()
    entries.read_string(wheel.read(name).decode())
    programs = dict(entries["console_scripts"])
    assert set(programs) == {"taichi-dem", "ca-damper"}
    for place in programs.values():
        assert callable(pkgutil.resolve_name(place))
    needs = about(wheel).get_all("Requires-Dist")
    always = {named(need) for need in needs if "extra ==" not in need}
    assert always == {"taichi", "numpy", "meshio", "matplotlib", "pillow", "rich", "jinja2"}


def named(requirement):
    """Name of a distribution in a requirement."""
    return re.match(r"[A-Za-z0-9-]+", requirement)[0]


def test_requirements_pin_what_users_and_tests_need_and_no_more(wheel):
    """The only two lists: of the wheel, with its extra for tests, and of ``make venv``."""
    needs = about(wheel).get_all("Requires-Dist")
    needed = {
        named(n) for n in needs if "extra ==" not in n or "extra == 'test'" in n.replace('"', "'")
    }
    lines = (FOLDER / "requirements.txt").read_text("utf-8").splitlines()
    pinned = {named(line) for line in lines if "==" in line}
    assert needed - {"taichi-dem"} <= pinned <= {named(need) for need in needs}
    assert "--only-binary :all:" in lines


def test_the_citation_has_the_version_the_authors_and_both_papers(wheel):
    text = (FOLDER / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {taichi_dem.__version__}\n" in text
    assert f'name: "{about(wheel)["Author"]}"' in text
    page = (FOLDER / "README.md").read_text("utf-8")
    for title in re.findall(r'^    title: "(.+)"$', text, re.MULTILINE):
        assert " ".join(title.split()) in " ".join(page.split())
    assert text.count("  - type: article") == 2


@pytest.mark.parametrize(
    ("package", "files"),
    [
        ("ca_damper", ("damper.gif", "decay.png", "decay.csv")),
        pytest.param(
            "taichi_dem",
            ("cracks.png", "blast.gif", "history.csv", "mesh.msh", "paraview/out.pvd"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_demonstration_runs_where_only_the_wheel_is(unpacked, tmp_path, package, files):
    options = ("--quick", "--json", "--threads", "2", "--arch", arch.chosen(), "--out", "out")
    summary = json.loads(said(unpacked, tmp_path, "-m", package, "demo", *options))
    assert summary["command"].startswith(f"-m {package} demo --quick")
    assert summary["quick"] is True and summary["figures"]
    for name in files:
        assert (tmp_path / "out" / name).is_file(), name


@pytest.mark.parametrize("package", ["taichi_dem", "ca_damper"])
def test_what_a_demonstration_does_not_know_is_one_sentence(unpacked, tmp_path, package):
    line = [sys.executable, "-m", package, "demo", "--colour", "red"]
    options = {"capture_output": True, "text": True, "cwd": tmp_path}
    done = subprocess.run(line, env=users_environment(PYTHONPATH=str(unpacked)), **options)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "unrecognized arguments: --colour red\n"
    assert list(tmp_path.iterdir()) == []


def test_what_is_unpacked_runs_and_reads_its_own_mesh(unpacked, tmp_path):
    text = "import taichi_dem as t; print(t.__file__, t.read_mesh(t.PAPER_BLOCK).source)"
    for path in said(unpacked, tmp_path, "-c", text).split():
        assert path.startswith(str(unpacked))


def test_what_is_unpacked_lists_no_experiments_and_says_where_the_first_page_is(unpacked, tmp_path):
    text = said(unpacked, tmp_path, "-m", "taichi_dem")
    assert "experiments/" not in text
    (first_page,) = unpacked.glob("*.dist-info/METADATA")
    assert str(first_page) in text


def test_versions_need_no_metadata(monkeypatch):
    """What runs from a path is known to no installer; the words are those of one that is."""
    words, versions = version_text(), study.versions()
    assert words == f"{taichi_dem.__version__} on taichi {importlib.metadata.version('taichi')}"
    for name in ("taichi", "numpy"):
        assert versions[name] == importlib.metadata.version(name)
    assert versions["taichi-dem"] == taichi_dem.__version__

    def absent(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata.Distribution, "from_name", absent)
    assert version_text() == words and study.versions() == versions
