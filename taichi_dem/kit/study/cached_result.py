"""Costly results, kept beside the output under a digest of everything they depend on."""

import hashlib
import importlib.util
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from taichi_dem.kit.checkpoint import identity_of
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import output_folder, write_text


def cached(
    folder: str, name: str, settings: Any, packages: Iterable[str], compute: Callable[[], dict]
) -> tuple[dict, bool]:
    """Result of ``compute()``, a JSON-like dict, from a file if it was computed before.

    settings: everything else the result depends on, by its content. packages: names of those whose
    sources it depends on. The file's name holds a digest of both: a change of either computes
    anew. Returns (result, whether it came from the file).
    """
    path = Path(output_folder(folder), f"{name}-{digest(settings, packages)}.json")
    if not path.exists():
        result = compute()
        write_text(path, json.dumps(result))
        return result, False
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")).items()), True
    except (OSError, ValueError, AttributeError, RecursionError) as error:
        raise InputError(f"cannot read the kept result {path}: {error}; delete it") from None


def digest(settings: Any, packages: Iterable[str]) -> str:
    """Twelve letters that change with the settings and with any source of the packages."""
    made = hashlib.sha256(identity_of(settings).encode())
    for package in packages:
        root = Path(str(importlib.util.find_spec(package).origin)).parent  # type: ignore[union-attr]
        for path in sorted(root.rglob("*.py")):
            # Pictures change no number.
            if "plot" not in path.relative_to(root).parts:
                made.update(path.read_bytes())
    return made.hexdigest()[:12]
