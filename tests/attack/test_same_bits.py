"""Same bits on processors of other kinds: other BLAS kernels, SIMD loops and C library functions.

The libraries take these by variables of the environment, as if the processor lacked the newer
instructions. Results named "control" are NumPy's and the C library's own: they show that a variable
acts, and are not promised.
"""

import json
import subprocess
import sys

import numpy as np
import pytest

from taichi_dem.kit.elementary import fifth_root, sine_and_cosine
from taichi_dem.kit.fixed_order import (
    inverse,
    inverse_factor,
    largest_eigenvalues,
    product,
    transposed,
    weakest_direction,
)
from tests.processes import users_environment
from tests.scenes import ROOT

ATTACKS = "bits: other processors and libraries"
ULP = 2.0**-52

_NUMPY = getattr(np, "_core", None) or np.core
_SIMD = _NUMPY._multiarray_umath.__cpu_dispatch__
_LIBM = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable"
#: Variables of the environment that stand for older processors.
OLDER = {
    "blas": {"OPENBLAS_CORETYPE": "Prescott"},
    "blas_with_avx": {"OPENBLAS_CORETYPE": "Sandybridge"},
    "numpy": {"NPY_DISABLE_CPU_FEATURES": " ".join(_SIMD)},
    "libm": {"GLIBC_TUNABLES": _LIBM},
}
OLDER["all"] = {**OLDER["blas"], **OLDER["numpy"], **OLDER["libm"]}


def bits(*words, **variables):
    """Digests of the program ``bits`` in a process of its own, controls left out."""
    command = [sys.executable, "-W", "ignore", "-m", "tests.attack.bits", *words]
    environment = users_environment(PYTHONPATH=ROOT, **variables)
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    return {name: letters for name, letters in found.items() if not name.startswith("control")}


@pytest.fixture(scope="module")
def here():
    """Digests on this processor as it is."""
    return bits("runs")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["blas", "blas_with_avx", "numpy", "libm"])
def test_tables_have_the_same_bits_on_another_processor(here, kind):
    found = bits(**OLDER[kind])
    assert found == {name: here[name] for name in found}


@pytest.mark.slow
def test_runs_have_the_same_bits_on_an_older_processor(here):
    assert bits("runs", **OLDER["all"]) == here


def test_factors_and_inverses_are_those_of_the_matrices(seed):
    """To cond x 2^-52 x a small power of the size: 50."""
    draw = np.random.default_rng(seed)
    half = draw.normal(size=(200, 3, 3)) * 10.0 ** draw.uniform(-2, 2, size=(200, 3, 1))
    matrices = product(half, transposed(half))
    bound = 50.0 * ULP * np.linalg.cond(matrices)[:, None, None]
    found, factor = inverse(matrices), inverse_factor(matrices)
    size = np.linalg.norm(found, axis=(1, 2), keepdims=True)
    assert (np.abs(found - np.linalg.inv(matrices)) <= bound * size).all()
    assert np.array_equal(found, transposed(found))
    assert (np.triu(factor, 1) == 0.0).all()


def test_eigenvalues_are_those_of_lapack(seed):
    """Both are backward stable: to a few dozen units in the last place of the largest."""
    draw = np.random.default_rng(seed)
    half = draw.normal(size=(300, 6, 6)) * 10.0 ** draw.uniform(-6, 6, size=(300, 6, 1))
    half[::3, 1:] = 0.0
    matrices = product(half, transposed(half))
    assert largest_eigenvalues(matrices) == pytest.approx(
        np.linalg.eigvalsh(matrices)[:, -1], rel=50 * ULP
    )
    values, axes = np.linalg.eigh(matrices[1, :3, :3])
    along = abs(weakest_direction(matrices[1, :3, :3]) @ axes[:, 0])
    gap = (values[1] - values[0]) / values[2]
    assert along == pytest.approx(1.0, abs=max(50 * ULP, (50 * ULP / gap) ** 2))
    assert list(largest_eigenvalues(np.zeros((2, 6, 6)))) == [0.0, 0.0]


def test_elementary_functions_are_exact_to_a_unit_in_the_last_place(seed):
    draw = np.random.default_rng(seed)
    angles = np.concatenate([draw.uniform(-1e6, 1e6, 2000), np.arange(40) * np.pi / 4, [0.0]])
    found = np.array([sine_and_cosine(x) for x in angles.tolist()])
    exact = np.stack([np.sin(angles.astype(np.longdouble)), np.cos(angles.astype(np.longdouble))])
    assert np.abs(found - exact.T).max() <= ULP
    values = 10.0 ** draw.uniform(-300, 300, 2000)
    roots = np.array([fifth_root(x) for x in values.tolist()])
    exact = values.astype(np.longdouble) ** (np.longdouble(1.0) / 5)
    assert (np.abs(roots - exact) <= 4 * ULP * exact).all()
    assert [fifth_root(x) for x in (1.0, 32.0, 2.0**-50)] == [1.0, 2.0, 2.0**-10]
