"""In hostile surroundings a program runs to the same bits and says nothing of them."""

import os
import subprocess
import sys

import numpy as np
import pytest

from tests.processes import users_environment
from tests.scenes import ROOT

pytestmark = pytest.mark.attack

#: Variables of Taichi that contradict ours or that it cannot read.
VARIABLES = """TI_ARCH=nonsense TI_DEBUG=x TI_FAST_MATH=1 TI_DEFAULT_FP=32 TI_DEFAULT_IP=-
    TI_CPU_MAX_NUM_THREADS=0 TI_ADVANCED_OPTIMIZATION=1 TI_OPT_LEVEL=0 TI_LOG_LEVEL=zz
    TI_RANDOM_SEED=x TI_PRINT_IR=1 TI_OFFLINE_CACHE_CLEANING_POLICY=zz TI_LIB_DIR=/nowhere
    TI_CHECK_OUT_OF_BOUND=1 ENABLE_TAICHI_HEADER_PRINT=x""".split()
_NUMPY = getattr(np, "_core", None) or np.core
#: Variables that stand for an older processor: other BLAS kernels, SIMD loops, C library functions.
OLDER = {
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": " ".join(_NUMPY._multiarray_umath.__cpu_dispatch__),
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable",
}
#: Other surroundings: variables, words for Python, and a line of the shell before and behind.
SURROUNDINGS = {
    "older processor": (OLDER, "-W ignore", "", ""),
    "home a file": ({"HOME": "{file}"}, "", "", ""),
    "warnings are errors": ({}, "-bb -W error", "", ""),
    "without docstrings": ({}, "-OO", "", ""),
    "ascii": ({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}, "", "", ""),
    "umask": ({}, "", "umask 0777", ""),
    "all closed": ({}, "", "", "<&- >&- 2>&-"),
    "reader leaves": ({}, "", "set -o pipefail", "| head -c 1"),
}


def program(folder, variables, words="", before="", behind=""):
    """Run ``bits`` by a shell in a folder; returns what it ended with, and what it has written."""
    (folder / "file").write_text("x")
    given = {name: text.format(file=folder / "file") for name, text in variables.items()}
    run = f"exec {sys.executable} {words} -m tests.attack.bits --out {folder}/out"
    done = subprocess.run(
        ["bash", "-c", f"{before or ':'}; ( {run} ) {behind}"],
        cwd=folder,
        env=users_environment(PYTHONPATH=ROOT, **given),
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert (done.returncode, done.stderr) == (0, ""), (variables, words)
    os.chmod(folder / "out", 0o700)
    os.chmod(folder / "out" / "digests.json", 0o600)
    return (folder / "out" / "digests.json").read_text()


@pytest.fixture(scope="module")
def digests(tmp_path_factory):
    """The digests in surroundings as they should be."""
    return program(tmp_path_factory.mktemp("plain"), {})


def test_a_run_has_the_same_bits_in_drawn_surroundings(tmp_path, digests, seed):
    """Some variables of Taichi together, and one other surrounding."""
    draw = np.random.default_rng(seed)
    chosen = dict(one.split("=") for one in draw.choice(VARIABLES, 6, replace=False))
    variables, *shell = list(SURROUNDINGS.values())[seed % len(SURROUNDINGS)]
    assert program(tmp_path, {**chosen, **variables}, *shell) == digests
