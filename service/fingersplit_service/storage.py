"""Files of the service: where they stand, and writes that leave either the whole file or none.

On one machine the data directory has them all. Several machines share them in an object store; their data directories
then hold copies, which may be deleted at any time.
"""

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

from fingersplit_service.blobs import Blob, BlobStore

__all__ = ["DataDirectoryInUse", "Storage"]


class DataDirectoryInUse(Exception):  # noqa: N818
    """Another service works on the same data directory."""


@dataclass(frozen=True)
class Storage:
    """The data directory; a plain value, so worker processes hold the same.

    Attributes:
        root: The directory.
        cache_bytes: Most that prepared objects may take on disk; of copies of shared files, too.
        shared: Where the files are kept that other machines need as well; None for one machine.
    """

    root: Path
    cache_bytes: int = 2**31
    shared: BlobStore | None = None

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

    def hand(self, hand_id: str) -> Path:
        """An uploaded hand: a zip of its model, its meshes and its description."""
        return self.root / "hands" / f"{hand_id}.zip"

    def hand_view(self, key: str, name: str) -> Path:
        """What people look at of a hand; ``key`` is an uploaded hand's id, or tells versions of a shipped one apart."""
        return self.root / "hand-views" / key / name

    def hands_before(self, moment: float) -> list[str]:
        """Ids of uploaded hands whose files were last written or claimed before ``moment`` [s since 1970]."""
        return [Path(blob.name).stem for blob in self._files("hands") if blob.modified < moment]

    def remove_hand(self, hand_id: str) -> None:
        """Delete an uploaded hand's file and what was made of it."""
        self.hand(hand_id).unlink(missing_ok=True)
        shutil.rmtree(self.root / "hand-views" / hand_id, ignore_errors=True)
        if self.shared is not None:
            views = [blob.name for blob in self.shared.entries(f"hand-views/{hand_id}/")]
            self.shared.delete([self._name(self.hand(hand_id)), *views])

    def job_folder(self, job_id: str) -> Path:
        """All files of a job."""
        return self.root / "jobs" / job_id

    def exists(self, path: Path) -> bool:
        """Whether a file is there, on whichever machine it was written.

        Raises:
            BlobsUnavailable: The object store does not answer.
        """
        return path.exists() if self.shared is None else self.shared.exists(self._name(path))

    def local(self, path: Path) -> Path:
        """A file that may have been written on another machine, as it can be read here.

        Raises:
            FileNotFoundError: It is nowhere.
            BlobsUnavailable: The object store does not answer.
        """
        if self.shared is not None:
            if path.exists():
                os.utime(path)  # the time of last use, which `forget_copies` goes by
            else:
                self.shared.get(self._name(path), path)
        elif not path.exists():
            raise FileNotFoundError(f"{path} is not there.")
        return path

    def claim(self, path: Path) -> None:
        """Say that a file is needed, wherever it was written, so that clean-up leaves it for a while.

        Raises:
            FileNotFoundError: It is nowhere.
            BlobsUnavailable: The object store does not answer.
        """
        os.utime(self.local(path))
        if self.shared is not None:
            self.shared.put(self._name(path), path)

    def remove_object(self, object_id: str) -> None:
        """Delete an object's files and what was computed of it."""
        for path in (*(self.root / "objects").glob(f"{object_id}.*"), *self.cache.glob(f"*-{object_id}-*")):
            path.unlink(missing_ok=True)
        if self.shared is not None:
            found = [blob.name for folder in ("objects/", "cache/") for blob in self.shared.entries(folder)]
            marks = (f"objects/{object_id}.", f"-{object_id}-")
            self.shared.delete([name for name in found if any(mark in name for mark in marks)])

    def remove_job(self, job_id: str) -> None:
        """Delete a job's files."""
        shutil.rmtree(self.job_folder(job_id), ignore_errors=True)
        if self.shared is not None:
            self.shared.delete([blob.name for blob in self.shared.entries(f"jobs/{job_id}/")])

    def objects_before(self, moment: float) -> list[str]:
        """Ids of objects whose files were last written or claimed before ``moment`` [s since 1970]."""
        newest = dict[str, float]()
        for blob in self._files("objects"):
            object_id = blob.name.split("/")[1].partition(".")[0]
            newest[object_id] = max(newest.get(object_id, 0.0), blob.modified)
        return [object_id for object_id, written in newest.items() if written < moment]

    def job_folders_before(self, moment: float) -> list[str]:
        """Ids of jobs whose files were last written before ``moment`` [s since 1970]."""
        return [name for written, name, _ in self._job_folders() if written < moment]

    def job_folders_beyond(self, most_bytes: int) -> list[str]:
        """Ids of the jobs with the oldest files, as many as have to go for the rest to take ``most_bytes`` at most."""
        sizes = self._job_folders()
        beyond = sum(size for _, _, size in sizes) - most_bytes
        leaving = []
        for _, name, size in sorted(sizes):
            if beyond <= 0:
                break
            leaving.append(name)
            beyond -= size
        return leaving

    def forget_copies(self) -> None:
        """Delete the copies of shared files that were not used for longest, until the rest takes ``cache_bytes``."""
        copies = [path for folder in ("objects", "jobs") for path in (self.root / folder).rglob("*") if path.is_file()]
        known = sorted((status.st_mtime, status.st_size, path) for path in copies if (status := _status(path)))
        beyond = sum(size for _, size, _ in known) - self.cache_bytes
        for _, size, path in known:
            if beyond <= 0:
                break
            path.unlink(missing_ok=True)
            beyond -= size

    def _job_folders(self) -> list[tuple[float, str, int]]:
        """When the files of each job were last written, its id, and how much they take [bytes]."""
        if self.shared is None:
            folder = self.root / "jobs"
            entries = list(os.scandir(folder)) if folder.is_dir() else []
            return [(one.stat().st_mtime, one.name, sum(f.stat().st_size for f in os.scandir(one))) for one in entries]
        found = dict[str, tuple[float, int]]()
        for blob in self._files("jobs"):
            job_id = blob.name.split("/")[1]
            written, size = found.get(job_id, (0.0, 0))
            found[job_id] = (max(written, blob.modified), size + blob.size)
        return [(written, job_id, size) for job_id, (written, size) in found.items()]

    def _files(self, folder: str) -> Iterator[Blob]:
        if self.shared is not None:
            yield from self.shared.entries(f"{folder}/")
        elif (self.root / folder).is_dir():
            for entry in os.scandir(self.root / folder):
                yield Blob(f"{folder}/{entry.name}", entry.stat().st_mtime, 0)

    def _name(self, path: Path) -> str:
        """What a file is called in the object store."""
        return path.relative_to(self.root).as_posix()

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
            if self.shared is not None:
                self.shared.put(self._name(path), staged)
            elif durable:
                _sync(staged)
            staged.replace(path)
            if durable and self.shared is None:
                _sync(path.parent)
        finally:
            staged.unlink(missing_ok=True)


def _status(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except FileNotFoundError:  # deleted meanwhile
        return None


def _sync(path: Path) -> None:
    """Flush a file, or the names in a directory, to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
