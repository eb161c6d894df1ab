"""Cache of source lines, so that Taichi reads kernels in half the time.

For a possible error message Taichi notes, at every name and operator, the source line and a mark
below it, broken at 80 characters; and wherever a function is called it parses its source to find
its end. Together that is half of the time in which it reads the kernels of a step, at each start of
a program. The results are cached here.
"""

import functools
import textwrap
from collections.abc import Callable
from typing import Any

from taichi.lang import kernel_impl
from taichi.lang.ast import ast_transformer_utils

#: Lines and marks that are kept; the kernels of a step have some ten thousand.
_MOST = 1 << 16


@functools.lru_cache(maxsize=_MOST)
def broken(text: str, width: int) -> tuple[str, ...]:
    """A text in lines of at most some characters, a tuple, as ``textwrap.wrap`` breaks it."""
    return tuple(textwrap.wrap(text, width))


class RememberingWrapper(textwrap.TextWrapper):
    """A ``textwrap.TextWrapper`` with the usual options that caches its results."""

    def wrap(self, text: str) -> list[str]:
        """Lines of a text, a list."""
        return list(broken(text, self.width))


def remembering(find: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Source lines of a function and their first number, as from find; cached."""
    cached = {}

    def lines(function):
        """Source lines of a function and the number of the first."""
        # Equal code of two files may differ in annotations, which are not part of it.
        key = (function.__code__.co_filename, function.__code__)
        if key not in cached:
            cached[key] = find(function)
        return cached[key]

    lines.cached = cached  # type: ignore[attr-defined]
    return lines


def remember() -> None:
    """Install both caches in Taichi, where it has the names of Taichi 1.7."""
    if hasattr(ast_transformer_utils, "TextWrapper"):
        ast_transformer_utils.TextWrapper = RememberingWrapper
    find = getattr(kernel_impl, "getsourcelines", None)
    if find is not None and not hasattr(find, "cached"):
        kernel_impl.getsourcelines = remembering(find)
