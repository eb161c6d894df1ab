"""Experiments run inside the test process."""

import importlib.util
import sys

import pytest

from tests.experiments.contract import FOLDER


@pytest.fixture(scope="module")
def main():
    """``main(name, arguments)`` of an experiment inside this process; returns the exit code."""
    sys.path.insert(0, str(FOLDER))
    try:
        import _cli

        def run(name, arguments):
            spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
            module = importlib.util.module_from_spec(spec)
            # A dataclass looks its module up.
            sys.modules[name] = module
            spec.loader.exec_module(module)
            given = ["--threads", "2", *map(str, arguments)]
            return _cli.main(module.run, module.options_parser(), given)

        yield run
    finally:
        sys.path.remove(str(FOLDER))
