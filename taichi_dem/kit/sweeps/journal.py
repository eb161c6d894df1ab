"""Finished jobs of a sweep, a small file each: whole or not there."""

import contextlib
import json
import os
from collections.abc import Iterable
from typing import Optional

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.sweeps.job import Job, Record
from taichi_dem.kit.validation import FileName

#: File that says whose jobs a folder holds, and the folder of their records.
_TITLE, _JOBS = "sweep.json", "jobs"


class Journal:
    """Records of finished jobs in a folder.

    folder: path; None for a journal that forgets. identity: of the function. Raises InputError for
    a folder that cannot be written to, or holds the jobs of another function.
    """

    def __init__(self, folder: Optional[FileName], identity: str):
        self.folder = "" if folder is None else output_folder(folder)
        self.kept = 0
        if self.folder:
            self._check(identity)
            output_folder(os.path.join(self.folder, _JOBS))
            write_text(os.path.join(self.folder, _TITLE), json.dumps({"function": identity}))

    def read(self, jobs: Iterable[Job]) -> dict[str, Record]:
        """Records of those jobs that are finished, by digest; damaged files do not count."""
        found = {}
        for job in jobs if self.folder else ():
            with contextlib.suppress(OSError, ValueError, TypeError):
                with open(self._path(job), encoding="utf-8") as file:
                    found[job.digest] = Record(**json.load(file))
        self.kept = len(found)
        return found

    def write(self, job: Job, record: Record) -> None:
        """Keep the record of a job that is final. Raises InputError where there is no space."""
        if not self.folder or not record.final:
            return
        write_text(self._path(job), json.dumps(record._asdict()))
        self.kept += 1

    def forget(self, job: Job) -> None:
        """Remove the record of a job, if there is one."""
        with contextlib.suppress(OSError):
            os.remove(self._path(job))

    def words(self) -> str:
        """How many jobs are kept, and where."""
        if not self.folder:
            return "finished jobs are lost, as the sweep has no folder out"
        return f"{self.kept} finished jobs are kept in {self.folder}, to go on from"

    def _path(self, job):
        return os.path.join(self.folder, _JOBS, f"{job.digest}.json")

    def _check(self, identity):
        path = os.path.join(self.folder, _TITLE)
        try:
            with open(path, encoding="utf-8") as file:
                there = json.load(file)["function"]
        except FileNotFoundError:
            return
        except (OSError, ValueError, KeyError, TypeError):
            raise InputError(f"{path} must say whose sweep the folder holds: delete it") from None
        if there != identity:
            raise InputError(
                f"out must be a folder of this sweep, of {identity}, got {self.folder}, which "
                f"holds one of {there}"
            )
