"""Same bits on processors of other kinds: other BLAS kernels, SIMD loops and C library functions.

The libraries take these by variables of the environment, as if the processor lacked the newer
instructions.
"""

import json
import subprocess
import sys

import numpy as np
import pytest

from tests.processes import users_environment
from tests.scenes import ROOT

pytestmark = pytest.mark.attack

_NUMPY = getattr(np, "_core", None) or np.core
_LIBM = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable"
#: Variables of the environment that stand for an older processor.
OLDER = {
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": " ".join(_NUMPY._multiarray_umath.__cpu_dispatch__),
    "GLIBC_TUNABLES": _LIBM,
}


def bits(**variables):
    """Digests of the program ``bits`` in a process of its own."""
    command = [sys.executable, "-W", "ignore", "-m", "tests.attack.bits"]
    environment = users_environment(PYTHONPATH=ROOT, **variables)
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_tables_and_runs_have_the_same_bits_on_an_older_processor():
    assert bits(**OLDER) == bits()
