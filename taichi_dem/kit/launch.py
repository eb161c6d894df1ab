"""Launches of a compiled kernel: 6 us of Python instead of the 100 of a call."""

from typing import Any

import numpy as np
from taichi.lang import impl

from taichi_dem.kit import backend
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.taichi_names import may_use, named

#: Names of Taichi by which a kernel is launched; without them each call is one of Taichi's own.
_ERRORS = "taichi.lang.exception.handle_exception_from_cpp"
_LAUNCHING = (
    _ERRORS,
    "taichi.lang.kernel_impl.Kernel.ensure_compiled",
    *(
        f"taichi._lib.core.{name}"
        for name in (
            *("Program.compile_kernel", "Program.config", "Program.get_device_caps"),
            *("Program.launch_kernel", "Kernel.make_launch_context"),
            *("KernelLaunchContext.set_arg_external_array_with_shape",),
            *("KernelLaunchContext.get_struct_ret_int", "KernelLaunchContext.set_arg_int"),
        )
    ),
)


class Launch:
    """A kernel, called with the same templates and other values each time."""

    def __init__(self, kernel: Any, *templates: Any):
        self._kernel, self._templates = kernel, templates
        self._ready: Any = None

    def __call__(self, *values: int | np.ndarray) -> Any:
        """Run it with these values; what it returns."""
        if not self._is_ready():
            found = self._kernel(*self._templates, *values)
            if may_use(*_LAUNCHING):
                self._ready = self._prepared(values)
            return found
        return self._launched(values, waits=self._ready[-1])

    def _is_ready(self):
        """Whether it was called in this session of Taichi."""
        return self._ready is not None and self._ready[0] is impl.get_runtime().prog

    def queue(self, *values: int | np.ndarray) -> None:
        """Run it some time soon, in order, without waiting for what it returns."""
        if not self._is_ready():
            self(*values)
        else:
            self._launched(values, waits=False)

    def _launched(self, values, waits):
        program, compiled, make_context, inner, _ = self._ready
        # One a launch: CUDA's leaves the address of the device's copy of the values in it.
        context = make_context()
        for place, value in enumerate(values):
            if isinstance(value, np.ndarray):
                # Of an array of vectors, the shape is that of the vectors alone.
                shape = value.shape[: value.ndim - inner[place]]
                where = value.ctypes.data, value.nbytes, shape
                context.set_arg_external_array_with_shape((place,), *where, 0)
            else:
                context.set_arg_int((place,), value)
        try:
            program.launch_kernel(compiled, context)
            if waits:
                program.synchronize()
                return context.get_struct_ret_int((0,))
        except Exception as error:
            raise _failed(error) from None
        return None

    def _prepared(self, values):
        """Taichi's program, the compiled kernel, and what makes a context of it."""
        kernel = self._kernel._primal
        owner = [self._kernel._kernel_owner] if hasattr(self._kernel, "_kernel_owner") else []
        key = kernel.ensure_compiled(*owner, *self._templates, *values)
        found, program = kernel.compiled_kernels[key], impl.get_runtime().prog
        compiled = program.compile_kernel(program.config(), program.get_device_caps(), found)
        kinds = [one.annotation for one in kernel.arguments[-len(values) :]] if values else []
        inner = [getattr(getattr(kind, "dtype", None), "ndim", 0) for kind in kinds]
        return program, compiled, found.make_launch_context, inner, kernel.return_type is not None


def _failed(error):
    """What to raise for an error of a launch: a device can be lost, or taken by another program."""
    if backend.is_cpu():
        return named(_ERRORS)(error)
    words = " ".join(str(error).split())
    return InputError(
        f"the device no longer answers ({words}): resume from the last checkpoint, or start "
        "again with arch 'cpu'"
    )
