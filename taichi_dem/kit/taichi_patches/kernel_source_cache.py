"""Cache of what Taichi looks up at every node of a kernel, so that it reads kernels faster."""

import functools
import gc
import linecache
import sys
import textwrap
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from taichi_dem.kit.taichi_patches.names import are_on, named

#: Numbers of which each range is kept; the kernels of a step have some hundred.
_MOST = 1 << 14
_KERNELS = "taichi.lang.kernel_impl"
_CONTEXT = "taichi.lang.ast.ast_transformer_utils.ASTTransformerContext"


def remembering(find: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """What find tells of the source of a function, cached."""
    cached = {}

    def found(function):
        # Equal code of two files may differ in annotations, which are not part of it.
        key = (function.__code__.co_filename, function.__code__)
        if key not in cached:
            cached[key] = find(function)
        return cached[key]

    return found


def filled(line: str, tabsize: int, width: int) -> str:
    """A line of source with spaces for tabs and none at its end, as ``textwrap.fill`` makes it."""
    if len(line) < width:
        return line.expandtabs(tabsize).rstrip()
    return textwrap.fill(line, tabsize=tabsize, width=width)


def undisturbed(read: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """The same function of a tree and a context, during which no garbage is collected."""

    def reading(tree, context):
        collects = gc.isenabled()
        gc.disable()
        try:
            return read(tree, context)
        finally:
            if collects:
                gc.enable()

    return reading


def position(context: Any, node: Any) -> str:
    """Where a node is in its file, for an error message: its first line, with marks below it."""
    line, begin = context.src[node.lineno - 1], context.indent + node.col_offset
    end = context.indent + node.end_col_offset if node.end_lineno == node.lineno else len(line)
    where = f'File "{context.file}", line {node.lineno + context.lineno_offset}'
    marks = " " * begin + "^" * (end - begin)
    return f"{where}, in {context.func.func.__name__}:\n{line}\n{marks}\n"


def declared_at(stacklevel: int = 1) -> str:
    """The line so many levels above the caller, for the whole stack that Taichi keeps."""
    frame = sys._getframe(1 + stacklevel)
    return f'  File "{frame.f_code.co_filename}", line {frame.f_lineno}\n'


def inside_class(level_of_class_stackframe: int) -> bool:
    """Whether the frame so many levels up begins a class, as Taichi's function of that name."""
    try:
        frame = sys._getframe(level_of_class_stackframe)
    except ValueError:
        return False
    line = linecache.getline(frame.f_code.co_filename, frame.f_lineno, frame.f_globals).strip()
    return any(
        pattern.match(line) for pattern in named(f"{_KERNELS}._KERNEL_CLASS_STACKFRAME_STMT_RES")
    )


class BoundKernel:
    """A kernel in its class, which is bound to its owner where it is asked for, and only then."""

    def __init__(self, kernel: Any, is_static: bool):
        self.kernel = kernel
        kernel._is_staticmethod = is_static

    def __get__(self, owner: Any, kind: type | None = None) -> Any:
        if owner is None:
            return self.kernel
        bound = named(f"{_KERNELS}._BoundedDifferentiableMethod")(owner, self.kernel)
        bound.__name__ = self.kernel.__name__
        return bound


def data_oriented(kind: Any) -> Any:
    """A class whose kernels, also those of its bases, are bound to its objects."""
    for base in kind.__mro__:
        for name, member in list(vars(base).items()):
            kernel = getattr(member, "__func__", member)
            if getattr(kernel, "_is_classkernel", False):
                setattr(base, name, BoundKernel(kernel, isinstance(member, staticmethod)))
    kind._data_oriented = True
    return kind


#: What is replaced in Taichi: where, and by what made of its own.
_REPLACED: tuple[tuple[str, str, Callable[[Any], Any]], ...] = (
    (_KERNELS, "getsourcelines", remembering),
    (_KERNELS, "getsourcefile", remembering),
    (_KERNELS, "textwrap", lambda own: SimpleNamespace(fill=filled, dedent=own.dedent)),
    (_KERNELS, "transform_tree", undisturbed),
    (_KERNELS, "_inside_class", lambda own: inside_class),
    ("taichi", "data_oriented", lambda own: data_oriented),
    (_CONTEXT, "get_pos_info", lambda own: position),
    ("taichi.lang.impl", "get_traceback", lambda own: declared_at),
    ("taichi.lang.snode", "get_traceback", lambda own: declared_at),
    ("taichi.lang.expr", "_check_in_range", functools.lru_cache(_MOST)),
    ("taichi.lang.expr", "_clamp_unsigned_to_range", functools.lru_cache(_MOST)),
)


def remember() -> None:
    """Install all of it."""
    for place, name, replacement in _REPLACED if are_on() else ():
        owner = named(place)
        setattr(owner, name, replacement(getattr(owner, name)))
