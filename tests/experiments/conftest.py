"""Runs of experiments: in processes of their own, each made once a file, and inside this one."""

import importlib.util
import sys

import pytest

from tests import arch
from tests.experiments.contract import FOLDER, figure_report, start


@pytest.fixture(scope="module")
def quick_run(tmp_path_factory):
    """``quick_run(name, *options)``: (folder, finished process)."""
    made = {}

    def run(name, *options):
        key = (name, *options)
        if key not in made:
            folder = tmp_path_factory.mktemp(name)
            report = figure_report(folder)
            made[key] = folder, start(name, "--quick", "--out", folder, *options, report=report)
        return made[key]

    return run


@pytest.fixture(scope="module")
def script():
    """``script(name)``: the module of an experiment, loaded into this process."""

    def load(name):
        spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        # A dataclass looks its module up.
        sys.modules[name] = module
        spec.loader.exec_module(module)
        return module

    sys.path.insert(0, str(FOLDER))
    yield load
    sys.path.remove(str(FOLDER))


@pytest.fixture(scope="module")
def main(script):
    """``main(name, arguments)`` of an experiment inside this process; returns the exit code."""

    def run(name, arguments):
        module = script(name)
        from taichi_dem.kit import study

        given = ["--threads", "2", "--arch", arch.chosen(), *map(str, arguments)]
        return study.main(module.run, module.options_parser(), given)

    return run
