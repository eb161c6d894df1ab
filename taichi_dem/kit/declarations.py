"""What Taichi holds for declared and not yet allocated, restored where a declaration fails."""

from typing import Any

from taichi.lang import impl

_FIELDS = ("global_vars", "grad_vars", "dual_vars", "matrix_fields")


class Declarations:
    """Fields and trees that Taichi takes for declared and not yet allocated, to return to.

    It would refuse every later kernel while it knows of a tree that is not finalized, or of a field
    without a place, as an exception between declaration and allocation leaves them.
    """

    def __init__(self):
        self._runtime, self._root = impl.get_runtime(), impl._root_fb
        self._trees = dict(self._runtime.unfinalized_fields_builder)
        self._fields = {name: list(getattr(self._runtime, name)) for name in _FIELDS}

    def restore_trees(self) -> None:
        """Forget the trees declared since."""
        if impl.get_runtime() is self._runtime:
            impl._root_fb = self._root
            self._runtime.unfinalized_fields_builder = dict(self._trees)

    def restore_fields(self, tree: Any = None) -> None:
        """Forget the fields declared since, and a tree."""
        if impl.get_runtime() is self._runtime:
            self._runtime.unfinalized_fields_builder.pop(tree, None)
            for name, fields in self._fields.items():
                setattr(self._runtime, name, list(fields))
