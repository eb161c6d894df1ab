"""Stands in for Taichi: ``import taichi`` gives the fork that is installed, Quadrants or Forge.

In an environment without Taichi this file lies on the path (a .pth file names its folder), and
nothing else of the project changes: each ``taichi.x`` is the very module ``quadrants.x`` or
``taichi_forge.x``, and errors answer to their old names too.
"""

import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import os
import sys

OLD = "taichi"
#: The fork's package, and the word that its errors begin with.
NEW, TITLE = next(
    (name, title)
    for name, title in (("quadrants", "Quadrants"), ("taichi_forge", "Taichi"))
    if importlib.util.find_spec(name)
)

os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")
# Quadrants reads QD_ where Taichi and Forge read TI_.
for option in ("SKIP_VERSION_CHECK", "LOG_LEVEL", "OFFLINE_CACHE", "OFFLINE_CACHE_FILE_PATH"):
    if f"TI_{option}" in os.environ:
        os.environ.setdefault(f"QD_{option}", os.environ[f"TI_{option}"])


def named_as_before(module):
    """A module of the fork in which its errors have Taichi's names as well."""
    for name in [name for name in vars(module) if name.startswith(TITLE)]:
        setattr(module, name.replace(TITLE, "Taichi", 1), vars(module)[name])
    return module


class Alias(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds ``taichi.x`` in the fork."""

    def find_spec(self, fullname, path=None, target=None):
        """The place of a module of Taichi; None for all others."""
        if not fullname.startswith(f"{OLD}."):
            return None
        return importlib.machinery.ModuleSpec(fullname, self)

    def create_module(self, spec):
        """The module of the fork that has its place, as it is."""
        module = importlib.import_module(spec.name.replace(OLD, NEW, 1))
        self.spec = module.__spec__
        return named_as_before(module)

    def exec_module(self, module):
        """Nothing is left to do but to give the module its own place back."""
        module.__spec__ = self.spec


sys.meta_path.insert(0, Alias())
sys.modules[OLD] = named_as_before(importlib.import_module(NEW))
