"""Measurements in processes of their own."""

import json
import os
import subprocess
import sys
import tempfile

from taichi_dem import InputError

_FOLDER = os.path.dirname(os.path.abspath(__file__))


def ask_worker(name, job, title, **environment):
    """What a worker, a script beside this one, prints last of a job: JSON in, JSON out.

    Raises InputError with the end of what it said, where it failed. title: of the job.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "job.json")
        with open(path, "w", encoding="utf-8") as handle:
            json.dump(job, handle)
        line = [sys.executable, os.path.join(_FOLDER, f"{name}.py"), path]
        options = {"capture_output": True, "text": True, "env": {**os.environ, **environment}}
        done = subprocess.run(line, **options)
    if done.returncode != 0:
        raise InputError(f"the run {title} ended with: {done.stderr.strip()[-300:]}")
    return json.loads(done.stdout.splitlines()[-1])


def read_job():
    """The job of this worker."""
    with open(sys.argv[1], encoding="utf-8") as handle:
        return json.load(handle)
