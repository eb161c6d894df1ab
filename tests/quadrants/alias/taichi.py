"""Stands in for Taichi: ``import taichi`` gives Quadrants, its maintained successor.

In an environment without Taichi this file lies on the path (a .pth file names its folder), and
nothing else of the project changes: each ``taichi.x`` is the very module ``quadrants.x``, and
errors answer to their old names too.
"""

import importlib
import importlib.abc
import importlib.machinery
import os
import sys

OLD, NEW = "taichi", "Quadrants"

os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")
# Quadrants reads QD_ where Taichi reads TI_.
for name in ("SKIP_VERSION_CHECK", "LOG_LEVEL", "OFFLINE_CACHE", "OFFLINE_CACHE_FILE_PATH"):
    if f"TI_{name}" in os.environ:
        os.environ.setdefault(f"QD_{name}", os.environ[f"TI_{name}"])


def named_as_before(module):
    """A module of Quadrants in which QuadrantsError is TaichiError as well."""
    for name in [name for name in vars(module) if name.startswith(NEW)]:
        setattr(module, name.replace(NEW, OLD.title(), 1), vars(module)[name])
    return module


class Alias(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds ``taichi.x`` as ``quadrants.x``."""

    def find_spec(self, fullname, path=None, target=None):
        """The place of a module of Taichi; None for all others."""
        if not fullname.startswith(f"{OLD}."):
            return None
        return importlib.machinery.ModuleSpec(fullname, self)

    def create_module(self, spec):
        """The module of Quadrants that has its place, as it is."""
        module = importlib.import_module(spec.name.replace(OLD, NEW.lower(), 1))
        self.spec = module.__spec__
        return named_as_before(module)

    def exec_module(self, module):
        """Nothing is left to do but to give the module its own place back."""
        module.__spec__ = self.spec


sys.meta_path.insert(0, Alias())
sys.modules[OLD] = named_as_before(importlib.import_module(NEW.lower()))
