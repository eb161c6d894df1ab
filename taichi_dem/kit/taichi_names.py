"""Names of Taichi that it does not promise, and that another version may lack."""

import functools
import warnings
from typing import Any

import taichi

WANTED = (1, 7, 4)
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
        lacking = [name for name in _OF_RUNTIME if not hasattr(runtime, name)]
    if lacking:
        raise ImportError(f"{_wanted(lacking[0])}, which is needed")


@functools.cache
def may_use(*paths: str) -> bool:
    """Whether this is the Taichi that is wanted and has all of these names; else it warns, once."""
    lacking = [path for path in paths if named(path) is None]
    if taichi.__version__ == WANTED and not lacking:
        return True
    _warn_once(lacking[0] if lacking else "")
    return False


def _wanted(lacking: str) -> str:
    """The sentence of another Taichi, to be completed."""
    wanted, got = (".".join(map(str, version)) for version in (WANTED, taichi.__version__))
    return f"taichi must be {wanted}, got {got}" + (f" without {lacking}" if lacking else "")


_warned: list[str] = []


def _warn_once(lacking: str) -> None:
    if not _warned:
        _warned.append(lacking)
        sentence = f"{_wanted(lacking)}: runs take longer, with the same bits"
        warnings.warn(sentence, stacklevel=3)
