"""Measurements in processes of their own."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Union

from taichi_dem.kit.errors import InputError


def ask_worker(script: Union[str, PathLike], job: dict, title: str, **environment: str) -> Any:
    """Answer of a worker, a script, to a job: JSON in; JSON out, on the last line it prints.

    Raises InputError with the end of what it said, where it failed. title: of the job.
    """
    return answer_of([str(script)], job, title, environment)


def answer_of(program: Sequence[str], job: dict, title: str, environment: Mapping[str, str]) -> Any:
    """The same of a program: arguments of Python, such as the name of a script."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "job.json")
        with open(path, "w", encoding="utf-8") as handle:
            json.dump(job, handle)
        line = [sys.executable, *program, path]
        options: Any = {"capture_output": True, "text": True, "env": {**os.environ, **environment}}
        done = subprocess.run(line, **options)
    if done.returncode != 0:
        raise InputError(f"the run {title} ended with: {done.stderr.strip()[-300:]}")
    return json.loads(done.stdout.splitlines()[-1])


def read_job() -> dict:
    """The job of this worker."""
    with open(sys.argv[1], encoding="utf-8") as handle:
        return json.load(handle)
