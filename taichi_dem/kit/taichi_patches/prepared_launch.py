"""Launches of a compiled kernel: 6 us of Python instead of the 100 of a call."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from taichi.lang import impl

from taichi_dem.kit import backend
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.taichi_patches.names import named


@dataclass
class PreparedLaunch:
    """A kernel as Taichi's program has compiled it.

    inner: dimensions of the entries of each array.
    """

    program: Any
    compiled: Any
    made_context: Callable[[], Any]
    inner: Sequence[int]
    returns: bool

    def is_of_this_session(self) -> bool:
        """Whether it was prepared in this session of Taichi."""
        return self.program is impl.get_runtime().prog

    def __call__(self, values: Sequence[int | np.ndarray], waits: bool = True) -> Any:
        """Run it with these values; what it returns, where there is any and one waits for it."""
        context = self._context(values)
        try:
            self.program.launch_kernel(self.compiled, context)
            if waits and self.returns:
                self.program.synchronize()
                return context.get_struct_ret_int((0,))
        except Exception as error:
            raise _failed(error) from None
        return None

    def _context(self, values):
        """The values as Taichi takes them."""
        # One a launch: CUDA's leaves the address of the device's copy of the values in it.
        context = self.made_context()
        for place, value in enumerate(values):
            if isinstance(value, np.ndarray):
                # Of an array of vectors, the shape is that of the vectors alone.
                shape = value.shape[: value.ndim - self.inner[place]]
                where = value.ctypes.data, value.nbytes, shape
                context.set_arg_external_array_with_shape((place,), *where, 0)
            else:
                context.set_arg_int((place,), value)
        return context


def prepared(kernel: Any, templates: Sequence[Any], values: Sequence[Any]) -> PreparedLaunch:
    """A kernel that was called with these templates and values."""
    own, program = kernel._primal, impl.get_runtime().prog
    owner = [kernel._kernel_owner] if hasattr(kernel, "_kernel_owner") else []
    kernel_code = own.compiled_kernels[own.ensure_compiled(*owner, *templates, *values)]
    compiled = program.compile_kernel(program.config(), program.get_device_caps(), kernel_code)
    kinds = [argument.annotation for argument in own.arguments[-len(values) :]] if values else []
    inner = [getattr(getattr(kind, "dtype", None), "ndim", 0) for kind in kinds]
    returns = own.return_type is not None
    return PreparedLaunch(program, compiled, kernel_code.make_launch_context, inner, returns)


def _failed(error):
    """What to raise for an error of a launch: a device can be lost, or taken by another program."""
    if backend.is_cpu():
        return named("taichi.lang.exception.handle_exception_from_cpp")(error)
    words = " ".join(str(error).split())
    return InputError(
        f"the device no longer answers ({words}): resume from the last checkpoint, or start "
        "again with arch 'cpu'"
    )
