"""Functions called in processes of their own."""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from taichi_dem.kit import children, runtime
from taichi_dem.kit.errors import InputError

_CHILD = """
import importlib, json, sys
folder, module, function, arch, threads, arguments = json.loads(sys.argv[1])
sys.path.insert(0, folder)
work = getattr(importlib.import_module(module), function)
from taichi_dem.kit import progress_bar, runtime
progress_bar.hide_bars()
runtime.start(arch, threads)
print(json.dumps(work(**arguments)))
"""


def call_in_process(
    work: Callable,
    *,
    arch: str = "",
    threads: int = 1,
    cache: str = "",
    title: str = "",
    **arguments: Any,
) -> Any:
    """Result of work(**arguments) in a new process, on this process's architecture by default."""
    file = Path(str(sys.modules[work.__module__].__file__)).absolute()
    settings: Any = runtime.settings()
    job = [str(file.parent), file.stem, work.__name__, arch or settings.arch, threads, arguments]
    environment = dict(os.environ)
    if cache:
        os.makedirs(cache, exist_ok=True)
        environment.update(TI_OFFLINE_CACHE="1", TI_OFFLINE_CACHE_FILE_PATH=cache)
    done = children.run([sys.executable, "-c", _CHILD, json.dumps(job)], env=environment)
    if done.returncode != 0:
        said = done.stderr.strip()[-300:]
        raise InputError(f"the run {title or f'of {work.__name__}'} ended with: {said}")
    # Taichi may have printed lines of its own before.
    return json.loads(done.stdout.splitlines()[-1])
