"""Finished jobs of a sweep, a small file each: whole or not there."""

import contextlib
import hashlib
import json
import os
import warnings
from collections.abc import Iterable

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.sweeps.job import Job, Record
from taichi_dem.kit.validation import FileName

#: File that says whose jobs a folder holds, and the folder of their records.
_TITLE, _JOBS = "sweep.json", "jobs"
#: Of what the key of a job covers; records under another one are not used.
_KEY = "function, what it calls and names, files"


class Journal:
    """Records of finished jobs in a folder.

    folder: path; None for a journal that forgets. identity: of the function. Raises InputError for
    a folder that cannot be written to, or holds the jobs of another function.
    """

    def __init__(self, folder: FileName | None, identity: str):
        self.folder = "" if folder is None else output_folder(folder)
        self.kept = 0
        if self.folder:
            self._check_title(identity)
            output_folder(os.path.join(self.folder, _JOBS))
            title = {"function": identity, "key": _KEY}
            write_text(os.path.join(self.folder, _TITLE), json.dumps(title))

    def read(self, jobs: Iterable[Job]) -> dict[str, Record]:
        """Records of those jobs that are finished, by digest.

        Damaged files do not count, nor those of a job that names a file which has changed.
        """
        found = {}
        for job in jobs if self.folder else ():
            with contextlib.suppress(OSError, ValueError, TypeError, KeyError):
                with open(self._path(job), encoding="utf-8") as file:
                    kept = json.load(file)
                record = Record(**kept["record"])
                if kept["check"] != _check(kept) or not _is_current(record, kept["files"], job):
                    continue
                found[job.digest] = record
        self.kept = len(found)
        return found

    def write(self, job: Job, record: Record) -> None:
        """Keep the record of a job that is final. Raises InputError where there is no space."""
        if not self.folder or not record.final:
            return
        kept = {"record": record._asdict(), "files": job.files}
        write_text(self._path(job), json.dumps({**kept, "check": _check(kept)}))
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

    def _check_title(self, identity):
        path = os.path.join(self.folder, _TITLE)
        try:
            with open(path, encoding="utf-8") as file:
                title = json.load(file)
            there, key = title["function"], title.get("key")
        except FileNotFoundError:
            return
        except (OSError, ValueError, KeyError, TypeError):
            raise InputError(f"{path} must say whose sweep the folder holds: delete it") from None
        if there != identity:
            raise InputError(
                f"out must be a folder of this sweep, of {identity}, got {self.folder}, which "
                f"holds one of {there}"
            )
        if key != _KEY:
            warnings.warn(
                f"finished jobs in {self.folder} are run again: an older version kept them, which "
                "did not notice changes of helpers, constants and files",
                stacklevel=4,
            )


def _check(kept):
    """Digest of a record and the files of its job, so that no changed digit is believed."""
    text = json.dumps([kept["record"], kept["files"]], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def _is_current(record, files, job):
    """Whether files are as they were: what has come since may be what the job wrote.

    Where the job failed it may be what it lacked.
    """
    if record.error:
        return files == job.files
    return all(job.files.get(path) == digest for path, digest in files.items())
