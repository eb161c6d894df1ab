"""Install a wheel in empty environments and run what it promises: ``make wheel``.

    python .ci/check_wheel.py dist/taichi_dem-0.1.0-py3-none-any.whl [PYTHON ...]

For each Python (by default the one that runs this): a new virtual environment, the wheel and what
it needs from wheels alone, then both demonstrations from an empty folder without this repository.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

#: Command lines in the environment's folder of programs, and what each leaves in the empty folder.
PROGRAMS = (
    (("taichi-dem", "--version"), ()),
    (("python", "-m", "ca_damper"), ()),
    (
        ("taichi-dem", "demo", "--quick", "--json", "--out", "blast"),
        ("blast/cracks.png", "blast/blast.gif", "blast/paraview/blast.pvd", "blast/summary.json"),
    ),
    (
        ("python", "-m", "ca_damper", "demo", "--quick"),
        ("results/quick/damper_demo/damper.gif", "results/quick/damper_demo/summary.json"),
    ),
)


def environment():
    """Variables of a user who has not set up Python in any way."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return {**kept, "PYTHONNOUSERSITE": "1"}


def call(line, folder):
    """Run a command line in a folder; its output. Ends this program where it fails."""
    options = {"cwd": folder, "env": environment(), "capture_output": True, "text": True}
    done = subprocess.run([str(part) for part in line], **options)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, line))} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


def check(wheel, python, scratch):
    """Install and run under one Python; a line on it."""
    started, place, empty = time.perf_counter(), Path(scratch, "env"), Path(scratch, "empty")
    empty.mkdir()
    call([python, "-m", "venv", place], scratch)
    programs = place / ("Scripts" if os.name == "nt" else "bin")
    install = ["-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    call([programs / "python", *install, "--only-binary", ":all:", wheel], scratch)
    for (name, *arguments), files in PROGRAMS:
        said = call([programs / name, *arguments], empty)
        if "--json" in arguments:
            json.loads(said)
        absent = [file for file in files if not (empty / file).is_file()]
        if absent:
            sys.exit(f"{name} {' '.join(arguments)} under {python} left no {', '.join(absent)}")
    facts = "import sys, numpy; print(sys.version.split()[0], 'numpy', numpy.__version__)"
    versions = call([programs / "python", "-c", facts], empty).strip()
    return f"Python {versions}: installed, both demonstrations ran, {spent(started)} s"


def spent(started):
    """Seconds since a time of ``time.perf_counter``, in words."""
    return f"{time.perf_counter() - started:.0f}"


def main():
    """Check under every Python that is named."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument("pythons", nargs="*", default=[sys.executable])
    options = parser.parse_args()
    for python in options.pythons:
        with tempfile.TemporaryDirectory() as scratch:
            print(check(options.wheel.resolve(), python, scratch), flush=True)


if __name__ == "__main__":
    main()
