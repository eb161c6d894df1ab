"""Every back end that answers here computes what a CPU does: same events, motion up to rounding."""

import functools
import json
import os
import subprocess
import sys

import numpy as np
import pytest

from taichi_dem.kit import backend
from tests.devices.launches import SCENES
from tests.scenes import ROOT

pytestmark = pytest.mark.gpu
#: Of the largest value, where a device rounds as a CPU does: what differs by 1e-16 grows by some
#: powers of ten within a run. CUDA fuses products and sums: positions of 0.1 m are rounded by 1e-17
#: m, and the openings that drive the bodies are a ten-millionth of a metre: a part in 1e10 of the
#: force, in every step anew.
SAME = {"vulkan": 1e-12, "cuda": 1e-8}


def present(name):
    """A back end, skipped where it does not answer."""
    reason = f"no {name} device answers here"
    return pytest.param(name, marks=pytest.mark.skipif(not backend.is_present(name), reason=reason))


PRESENT = [present(name) for name in backend.GPUS]


def said(*arguments):
    """What a process of Python with these arguments prints."""
    line, environment = [sys.executable, *arguments], {**os.environ, "PYTHONPATH": ROOT}
    done = subprocess.run(line, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    """What a back end computes of ``work``, arrays by name; each once, in a process of its own."""
    folder = tmp_path_factory.mktemp("devices")

    @functools.cache
    def of(arch):
        said("-m", "tests.devices.work", arch, str(folder))
        return dict(np.load(folder / f"{arch}.npz"))

    return of


@pytest.mark.parametrize("arch", PRESENT)
def test_a_device_computes_what_a_cpu_does(computed, arch):
    """Integers are equal; |x - x_cpu| <= SAME max |x_cpu|, by every method, in both packages.

    So does a run that goes on from a checkpoint of a CPU. Bonds break, and pairs touch.
    """
    here, there = computed("cpu"), computed(arch)
    assert here.keys() == there.keys()
    for name, expected in here.items():
        if expected.dtype.kind == "f":
            worst = np.abs(there[name] - expected).max()
            assert worst <= SAME[arch] * np.abs(expected).max(), name
        else:
            assert np.array_equal(there[name], expected), name
        assert not name.endswith("broken_tick") or (expected >= 0).sum() >= 8, name
        assert not name.endswith("evaluations") or expected[3] > 0, name


@pytest.mark.parametrize("arch", PRESENT)
def test_fields_keep_apart_and_a_launch_that_falls_short_is_an_error(arch):
    """Fields of drawn trees, and a driver that ends loops after some rounds, in both packages."""
    found = json.loads(said("-m", "tests.devices.checks", arch).splitlines()[-1])
    assert found["trees"] == 12 and found["damaged"] == 0
    for package in ("blast", "damper"):
        refused = f"{found['rounds']} rounds" in found[package]
        assert refused == (found["rounds"] > 0), package


@pytest.mark.parametrize("arch", PRESENT)
def test_substeps_are_queued(arch):
    """Launches and reads of a substep; those of a contact search are counted apart.

    Launches <= fixed ones + (sweeps + 1) those of a sweep: as many sweeps are queued as the steps
    before have needed, and one more.
    """
    found = json.loads(said("-m", "tests.devices.launches", arch).splitlines()[-1])
    for name, (_, _, (fixed, of_sweep, reads)) in SCENES.items():
        one = found[name]
        assert one["launches"] <= fixed + of_sweep * (one["sweeps"] + 1), name
        assert one["reads"] <= reads, name
