"""Objects tied to a session: refused in words where they are copied or pickled."""

from typing import Any, NoReturn

from taichi_dem.kit.errors import InputError


class Uncopied:
    """Base of objects that own or view fields of a session, of which a copy would share them.

    uncopied: what to use in its place, as the end of a sentence.
    """

    uncopied = "copy or pickle the scene, the method or the result instead"

    def __reduce_ex__(self, protocol: Any) -> NoReturn:
        raise InputError(
            f"a {type(self).__name__} cannot be copied or pickled, as its data lie in the memory "
            f"of a Taichi session: {self.uncopied}"
        )
