"""Names of Taichi that it does not promise; whether patches are used with the Taichi at hand."""

import functools
import os
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import taichi

from taichi_dem.kit.validation import choice

WANTED = (1, 7, 4)
SWITCH = "TAICHI_DEM_PATCHES"
#: Without which nothing runs, by module or class.
NEEDED = {
    "taichi._lib.core": "DebugInfo ExprGroup with_cuda with_vulkan",
    "taichi._snode.fields_builder.FieldsBuilder": "_finalized_roots finalize",
    "taichi.lang.expr": "Expr",
    "taichi.lang.impl": "_root_fb current_cfg default_cfg expr_init get_runtime inside_kernel",
    "taichi.lang.matrix": "MatrixField",
    "taichi.lang.snode": "SNode",
    "taichi.lang.struct": "StructField",
    "taichi.lang.util": "to_numpy_type",
}
#: Of what ``taichi.lang.impl.get_runtime`` returns.
_OF_RUNTIME = (
    *("dual_vars", "get_current_src_info", "global_vars", "grad_vars", "initialize_fields_builder"),
    *("matrix_fields", "prog", "unfinalized_fields_builder"),
)
#: Of patches alone.
SAVING = {
    "taichi._lib.core.Kernel": "make_launch_context",
    "taichi._lib.core.KernelLaunchContext": "get_struct_ret_int set_arg_external_array_with_shape"
    " set_arg_int",
    "taichi._lib.core.Program": "compile_kernel config get_device_caps launch_kernel",
    "taichi._lib.core.SNode": "cell_size_bytes offset_bytes_in_parent_cell",
    "taichi.lang.ast.ast_transformer_utils.ASTTransformerContext": "get_pos_info",
    "taichi.lang.exception": "handle_exception_from_cpp",
    "taichi.lang.expr": "_check_in_range _clamp_unsigned_to_range",
    "taichi.lang.impl": "get_traceback",
    "taichi.lang.kernel_impl": "_BoundedDifferentiableMethod _KERNEL_CLASS_STACKFRAME_STMT_RES"
    " _inside_class data_oriented getsourcefile getsourcelines textwrap transform_tree",
    "taichi.lang.kernel_impl.Kernel": "ensure_compiled",
    "taichi.lang.snode": "get_traceback",
}


def named(path: str) -> Any:
    """What has a name in Taichi, such as taichi.lang.impl.get_runtime; None where it is missing."""
    return functools.reduce(lambda at, name: getattr(at, name, None), path.split(".")[1:], taichi)


def paths(table: Mapping[str, str]) -> Iterator[str]:
    """Full names of a table."""
    for place, names in table.items():
        yield from (f"{place}.{name}" for name in names.split())


def _lacking(table):
    return [path for path in paths(table) if named(path) is None]


def check_needed() -> None:
    """Raise ImportError where Taichi lacks a name without which nothing runs."""
    lacking = _lacking(NEEDED)
    if not lacking:
        runtime = named("taichi.lang.impl.get_runtime")()
        lacking = [name for name in _OF_RUNTIME if not hasattr(runtime, name)]
    if lacking:
        raise ImportError(f"{_wanted(lacking)}, which is needed")


@functools.cache
def are_on() -> bool:
    """Whether patches are used: with the Taichi that is wanted, unless the user switches them off.

    Another Taichi is said once.
    """
    if choice(SWITCH, os.environ.get(SWITCH, "on"), ("on", "off")) == "off":
        return False
    lacking = _lacking(SAVING)
    if taichi.__version__ == WANTED and not lacking:
        return True
    warnings.warn(f"{_wanted(lacking)}: runs take longer, with the same bits", stacklevel=3)
    return False


def _wanted(lacking):
    """The sentence of another Taichi, to be completed."""
    wanted, got = (".".join(map(str, version)) for version in (WANTED, taichi.__version__))
    return f"taichi must be {wanted}, got {got}" + (f" without {lacking[0]}" if lacking else "")
