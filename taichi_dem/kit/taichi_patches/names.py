"""Names of Taichi without which nothing runs; whether patches are used with the one at hand."""

import functools
import os
import warnings
from typing import Any

import taichi

from taichi_dem.kit.validation import choice

WANTED = (1, 7, 4)
SWITCH = "TAICHI_DEM_PATCHES"
#: By module or class.
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


def named(path: str) -> Any:
    """What has a name in Taichi, such as taichi.lang.impl.get_runtime; None where it is missing."""
    return functools.reduce(lambda at, name: getattr(at, name, None), path.split(".")[1:], taichi)


def check_needed() -> None:
    """Raise ImportError where Taichi lacks a name without which nothing runs."""
    paths = [f"{place}.{name}" for place, names in NEEDED.items() for name in names.split()]
    lacking = [path for path in paths if named(path) is None]
    if not lacking:
        runtime = named("taichi.lang.impl.get_runtime")()
        lacking = [name for name in _OF_RUNTIME if name not in dir(runtime)]
    if lacking:
        raise ImportError(f"{_wanted()} without {lacking[0]}, which is needed")


@functools.cache
def are_on() -> bool:
    """Whether patches are used: with the Taichi that is wanted, unless the user switches them off.

    Another Taichi is said once.
    """
    if choice(SWITCH, os.environ.get(SWITCH, "on"), ("on", "off")) == "off":
        return False
    if taichi.__version__ != WANTED:
        warnings.warn(f"{_wanted()}: runs take longer, with the same bits", stacklevel=3)
    return taichi.__version__ == WANTED


def _wanted():
    """The sentence of another Taichi, to be completed."""
    wanted, got = (".".join(map(str, version)) for version in (WANTED, taichi.__version__))
    return f"taichi must be {wanted}, got {got}"
