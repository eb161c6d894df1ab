"""Where tests run their kernels: ``pytest --arch`` sets it, for the processes they start too."""

import os

_NAME = "TEST_ARCH"


def choose(arch):
    """Let all tests of this run use an architecture."""
    os.environ[_NAME] = arch


def chosen():
    """The architecture of this run: "cpu" or "cuda"."""
    return os.environ[_NAME]
