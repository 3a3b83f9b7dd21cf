"""Files of the service: where they stand, and writes that leave either the whole file or none."""

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

__all__ = ["DataDirectoryInUse", "Storage"]


class DataDirectoryInUse(Exception):  # noqa: N818
    """Another service works on the same data directory."""


@dataclass(frozen=True)
class Storage:
    """The data directory; a plain value, so worker processes hold the same.

    Attributes:
        root: The directory.
        cache_bytes: Most that prepared objects may take on disk.
    """

    root: Path
    cache_bytes: int = 2**31

    @property
    def database(self) -> Path:
        """The job table."""
        return self.root / "fingersplit.sqlite3"

    @property
    def staging(self) -> Path:
        """Unfinished files; on the file system of the finished ones, so they can be renamed into place."""
        return self.root / "staging"

    @property
    def cache(self) -> Path:
        """What was computed of objects, by their ids; it can be deleted at any time and is computed again."""
        return self.root / "cache"

    def shape(self, object_id: str) -> Path:
        """The checked mesh or point cloud of an object, in metres, with its options, as arrays."""
        return self.root / "objects" / f"{object_id}.npz"

    def mesh_export(self, object_id: str, file_type: str) -> Path:
        """The mesh of an object as a file of another format."""
        return self.root / "objects" / f"{object_id}.{file_type}"

    def job_folder(self, job_id: str) -> Path:
        """All files of a job."""
        return self.root / "jobs" / job_id

    def remove_object(self, object_id: str) -> None:
        """Delete an object's files and what was computed of it."""
        for path in (*(self.root / "objects").glob(f"{object_id}.*"), *self.cache.glob(f"*-{object_id}-*")):
            path.unlink(missing_ok=True)

    def remove_job(self, job_id: str) -> None:
        """Delete a job's files."""
        shutil.rmtree(self.job_folder(job_id), ignore_errors=True)

    def objects_before(self, moment: float) -> list[str]:
        """Ids of objects whose files were last written or claimed before ``moment`` [s since 1970]."""
        folder, newest = self.root / "objects", dict[str, float]()
        if not folder.is_dir():
            return []
        for entry in os.scandir(folder):
            object_id = entry.name.partition(".")[0]
            newest[object_id] = max(newest.get(object_id, 0.0), entry.stat().st_mtime)
        return [object_id for object_id, written in newest.items() if written < moment]

    def job_folders_before(self, moment: float) -> list[str]:
        """Ids of jobs whose files were last written before ``moment`` [s since 1970]."""
        folder = self.root / "jobs"
        if not folder.is_dir():
            return []
        return [entry.name for entry in os.scandir(folder) if entry.stat().st_mtime < moment]

    def job_folders_beyond(self, most_bytes: int) -> list[str]:
        """Ids of the jobs with the oldest files, as many as have to go for the rest to take ``most_bytes`` at most."""
        folder = self.root / "jobs"
        if not folder.is_dir():
            return []
        sizes = [
            (entry.stat().st_mtime, entry.name, sum(file.stat().st_size for file in os.scandir(entry)))
            for entry in os.scandir(folder)
        ]
        beyond = sum(size for _, _, size in sizes) - most_bytes
        leaving = []
        for _, name, size in sorted(sizes):
            if beyond <= 0:
                break
            leaving.append(name)
            beyond -= size
        return leaving

    def view(self, job_id: str, rank: int, name: str) -> Path:
        """What people look at of one grasp: ``picture.png``, ``recording.rrd`` and the like."""
        return self.job_folder(job_id) / f"grasp-{rank}-{name}"

    def staged(self, suffix: str) -> Path:
        """A name nobody has for an unfinished file."""
        return self.staging / f"{uuid4().hex}{suffix}"

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Hold the directory for this process, and clear what a dead one left unfinished.

        Raises:
            DataDirectoryInUse: Another process holds it.
        """
        self.root.mkdir(parents=True, exist_ok=True)
        with (self.root / "lock").open("w") as holder:
            try:
                fcntl.flock(holder, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise DataDirectoryInUse(
                    f"Another service works on {self.root}; stop it, or choose another data directory."
                ) from None
            shutil.rmtree(self.staging, ignore_errors=True)
            self.staging.mkdir()
            yield

    @contextmanager
    def atomic(self, path: Path, *, durable: bool = True, make_folder: bool = True) -> Iterator[Path]:
        """Give a staged path to write to; once written without error it becomes ``path``.

        Args:
            path: The file to make.
            durable: Whether it must survive a loss of power, which takes time.
            make_folder: Whether to make the folder where it is not there; without, the file of what was deleted
                meanwhile is not written.

        Raises:
            FileNotFoundError: The folder is not there and is not to be made.
        """
        staged = self.staged(path.suffix)
        try:
            yield staged
            if make_folder:
                path.parent.mkdir(parents=True, exist_ok=True)
            if durable:
                _sync(staged)
            staged.replace(path)
            if durable:
                _sync(path.parent)
        finally:
            staged.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Flush a file, or the names in a directory, to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
