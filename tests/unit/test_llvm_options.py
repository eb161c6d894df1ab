"""Kernels are compiled without LLVM's run-time unrolling, and a library without names says so."""

import subprocess
import sys

import pytest

from tests.processes import users_environment
from tests.scenes import ROOT

_SUM = """
import sys
from taichi_dem import runtime
if "off" in sys.argv:
    runtime.start()
    runtime.stop()
import taichi as ti

ti.init(ti.cpu, default_fp=ti.f64, offline_cache=False, print_kernel_llvm_ir_optimized=True)
x = ti.field(ti.f64, 64)

@ti.kernel
def total(n: ti.i32) -> ti.f64:
    found = 0.0
    for _ in range(1):
        for k in range(n):
            found += x[k]
    return found

total(5)
"""


def additions(folder, *words):
    """Additions in the optimised code of a sum."""
    folder.mkdir()
    (folder / "sum.py").write_text(_SUM)
    line, environment = [sys.executable, "sum.py", *words], users_environment(PYTHONPATH=ROOT)
    subprocess.run(line, check=True, capture_output=True, cwd=folder, env=environment)
    (code,) = folder.glob("*optimized*.ll")
    return code.read_text().count(" fadd ")


@pytest.mark.skipif(sys.platform != "linux", reason="it is switched off on Linux alone")
def test_a_session_leaves_loops_unrepeated(tmp_path):
    assert additions(tmp_path / "off", "off") < 8 <= additions(tmp_path / "on")
