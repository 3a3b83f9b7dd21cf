"""The folder of a data set: its manifest, its shards, the objects that failed, and who is writing to it."""

import fcntl
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fingersplit.dataset.request import SCHEMA, SCHEMA_VERSION, SPLITS, DatasetObject, DatasetRequest, manifest_of
from fingersplit.dataset.shards import PART, ShardHead, read_head
from fingersplit.errors import DatasetError

__all__ = ["FAILED", "MANIFEST", "DatasetFolder", "write_whole"]

MANIFEST = "dataset.json"
FAILED = "failed"
LOCK = ".lock"


class DatasetFolder:
    """What is on disk of a data set; everything else follows from it, so a killed program loses nothing.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @contextmanager
    def begun(self, request: DatasetRequest, objects: Sequence[DatasetObject]) -> Iterator[None]:
        """Write to it, alone: a new folder, or one that was begun for the same request and objects.

        Raises:
            DatasetError: Another program writes to it, it was begun with another order, or it cannot be written.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock = (self.path / LOCK).open("w")
        except OSError as error:
            raise DatasetError(f"{self.path} cannot be written: {error.strerror}.") from error
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise DatasetError(f"Another program is writing to {self.path}.") from error
            self._claim(request, objects)
            for split in (*SPLITS, FAILED):
                (self.path / split).mkdir(exist_ok=True)
            for part in self.path.glob(f"*/*{PART}"):
                part.unlink(missing_ok=True)
            yield

    def _claim(self, request: DatasetRequest, objects: Sequence[DatasetObject]) -> None:
        manifest = manifest_of(request, objects)
        file = self.path / MANIFEST
        if not file.exists():
            if any(child.name != LOCK for child in self.path.iterdir()):
                raise DatasetError(f"{self.path} is not empty and holds no data set; give a new folder.")
            write_whole(file, json.dumps(manifest, indent=2) + "\n")
        elif (known := self.manifest()) != manifest:
            raise DatasetError(f"{self.path} was begun with {_difference(known, manifest)}; give a new folder.")

    def manifest(self) -> dict[str, Any]:
        """The manifest.

        Raises:
            DatasetError: There is none of this version.
        """
        try:
            document: Any = json.loads((self.path / MANIFEST).read_bytes())
        except (OSError, ValueError) as error:
            raise DatasetError(f"{self.path} holds no data set: {MANIFEST} cannot be read.") from error
        if not isinstance(document, dict) or document.get("schema") != SCHEMA:
            raise DatasetError(f"{self.path / MANIFEST} is no manifest of a data set.")
        if document.get("schema_version") != SCHEMA_VERSION:
            raise DatasetError(
                f"{self.path} has schema version {document.get('schema_version')}, not {SCHEMA_VERSION}."
            )
        return document

    def request(self) -> DatasetRequest:
        """What the data set is to hold."""
        return DatasetRequest.from_document(self.manifest()["order"])

    def objects(self) -> list[DatasetObject]:
        """Its objects."""
        return [DatasetObject(**item) for item in self.manifest()["objects"]]

    def shard_files(self) -> list[Path]:
        """Every shard that is there, by split, object and round."""
        return sorted(self.path.glob("*/*.h5"))

    def heads(self, item: DatasetObject) -> list[ShardHead]:
        """The shards of an object, by round."""
        return [read_head(path) for path in sorted((self.path / item.split).glob(f"{item.label}.*.h5"))]

    def fail(self, item: DatasetObject, code: str, message: str) -> None:
        """Note that nothing (more) can be planned for an object."""
        document = {"object": item.name, "file": item.file, "code": code, "message": message}
        write_whole(self.path / FAILED / f"{item.label}.json", json.dumps(document, indent=2) + "\n")

    def failures(self) -> dict[int, dict[str, Any]]:
        """What was noted, by the object's index."""
        files = sorted((self.path / FAILED).glob("*.json"))
        return {int(file.name.partition("-")[0]): json.loads(file.read_bytes()) for file in files}

    def forget_failures(self) -> None:
        """Try the objects again that have failed."""
        for file in (self.path / FAILED).glob("*.json"):
            file.unlink()


def write_whole(path: Path, text: str) -> None:
    """Write a file that others see whole or not at all."""
    part = path.with_name(f"{path.name}.{os.getpid()}{PART}")
    with part.open("w", encoding="utf-8") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    part.replace(path)


def _difference(known: dict[str, Any], wanted: dict[str, Any]) -> str:
    """The first entry in which two manifests differ, in words."""
    for name, value in wanted["order"].items():
        if known["order"].get(name) != value:
            return f"{name} = {known['order'].get(name)!r}, not {value!r}"
    return f"other objects ({len(known['objects'])}, not {len(wanted['objects'])}, or others of the same number)"
