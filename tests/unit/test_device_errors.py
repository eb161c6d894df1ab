"""What a device refuses or loses is one sentence, and the session goes on."""

import pytest
import taichi as ti
from taichi._snode.fields_builder import FieldsBuilder
from taichi.lang import impl

from taichi_dem import InputError
from taichi_dem.kit import backend
from taichi_dem.kit.allocation import CapacityError, FieldTree, assign, values
from taichi_dem.kit.launch import Launch


class Lost:
    """A program, and a context of a launch, of a device that has gone."""

    def set_arg_int(self, place, value):
        """Take an argument."""

    def launch_kernel(self, compiled, context):
        """Find no device."""
        raise RuntimeError("CUDA_ERROR_LAUNCH_FAILED:\n unspecified launch failure")


def launched_in(program, monkeypatch, context, returns):
    """A Launch that has been called in a program, which is that of the session."""
    monkeypatch.setattr(impl.get_runtime(), "prog", program)
    launch = Launch(None)
    launch._ready = (program, None, context, [0], returns)
    return launch


@pytest.mark.parametrize("call", [Launch.__call__, Launch.queue])
def test_a_lost_device_is_told_with_what_to_do(call, monkeypatch):
    launch = launched_in(Lost(), monkeypatch, Lost, True)
    monkeypatch.setattr(backend, "is_cpu", lambda: False)
    with pytest.raises(InputError, match=r"^the device no longer answers .*checkpoint, or"):
        call(launch, 1)


class OneLaunch:
    """A context as CUDA's: its launch leaves an address of the device where values are written."""

    spent = False

    def set_arg_int(self, place, value):
        """Take an argument."""
        assert not self.spent


class Spending:
    """A program that spends contexts."""

    def launch_kernel(self, compiled, context):
        """Note it."""
        context.spent = True


def test_a_context_is_launched_once(monkeypatch):
    launch = launched_in(Spending(), monkeypatch, OneLaunch, False)
    for call in (Launch.__call__, Launch.queue) * 2:
        call(launch, 1)


def test_memory_that_a_device_refuses_is_told_with_its_size(monkeypatch):
    """Nothing of the tree is left: the next one is allocated."""

    def refuse(self, raise_warning):
        raise RuntimeError("out of memory")

    with monkeypatch.context() as change:
        change.setattr(FieldsBuilder, "finalize", refuse)
        with pytest.raises(CapacityError, match=r"^this needs .* GB, .*\(out of memory\): smaller"):
            with FieldTree("smaller"):
                ti.field(ti.f64, shape=1000)
    with FieldTree():
        field = ti.field(ti.f64, shape=3)
    assign(field, [1.0, 2.0, 3.0])
    assert values(field).tolist() == [1.0, 2.0, 3.0]


def test_memory_of_the_host_is_not_asked_for_a_card(monkeypatch):
    """CUDA has its own; Vulkan's software driver takes that of the host."""
    found = {}
    for arch in (ti.cuda, ti.vulkan, ti.x64):
        monkeypatch.setattr(backend, "impl", Config(arch))
        found[arch] = backend.in_host_memory()
    assert found == {ti.cuda: False, ti.vulkan: True, ti.x64: True}


class Config:
    """Taichi's settings with a back end."""

    def __init__(self, arch):
        self.arch = arch

    def current_cfg(self):
        """The settings."""
        return self
