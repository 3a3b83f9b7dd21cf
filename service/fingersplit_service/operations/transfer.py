"""Takes everything out of one service and puts it into another: from one machine to several, and back."""

import json
import shutil
import tarfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any

import sqlalchemy as sa

from fingersplit_service.blobs import BlobStore
from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.database.keys import LOCAL_OWNER
from fingersplit_service.database.schema import HEAD
from fingersplit_service.database.store import insert_missing
from fingersplit_service.database.tables import agents, metadata, objects
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["ArchiveError", "Transferred", "export_data", "import_data"]

_MANIFEST, _TABLES, _FILES = "manifest.json", "tables/", "files/"
_FOLDERS = ("objects", "jobs")
_PATIENCE = 30.0  # with an object store [s]
_NOBODY: dict[str, Any] = {"runner": None, "verifier": None}


class ArchiveError(Exception):
    """An archive cannot be imported."""


@dataclass(frozen=True)
class Transferred:
    """How many rows and files were written; what was there already is not counted."""

    rows: int
    files: int


def export_data(settings: ServiceSettings, target: Path) -> Transferred:
    """Write all rows and files of a service to an archive, a tar file.

    Args:
        settings: Of the service. One machine's must not run meanwhile; of several machines none should accept jobs.
        target: The archive.

    Raises:
        DataDirectoryInUse: The service runs.
        StorageUnavailable, BlobsUnavailable: Not everything can be read.
    """
    rows = files = 0
    with (
        _opened(settings) as (database, storage),
        TemporaryDirectory() as scratch,
        tarfile.open(target, "w") as archive,
        database.long_transaction() as connection,
    ):
        _add_text(archive, _MANIFEST, json.dumps({"schema": HEAD}), Path(scratch))
        for table in metadata.sorted_tables:
            if table is not agents:
                text = [json.dumps(dict(row)) for row in connection.execute(_in_order(table)).mappings()]
                rows += len(text)
                _add_text(archive, f"{_TABLES}{table.name}.jsonl", "\n".join(text), Path(scratch))
        for name, path in _files(storage):
            archive.add(path, _FILES + name)
            files += 1
    return Transferred(rows, files)


def import_data(settings: ServiceSettings, source: Path, local_to: str | None = None) -> Transferred:
    """Add everything of an archive to a service; what is there already stays, so it can be repeated.

    Jobs that ran when they were exported wait again. API keys go along.

    Args:
        settings: Of the service. One machine's must not run meanwhile.
        source: The archive.
        local_to: Id of the key that gets what was made while the service had no keys; None to leave it without one.

    Raises:
        ArchiveError: It is none, or of another version.
        DataDirectoryInUse: The service runs.
        StorageUnavailable, BlobsUnavailable: Rows come after all files, in one transaction: repeat it.
    """
    try:
        with _opened(settings) as (database, storage), tarfile.open(source) as archive:
            members = {member.name: member for member in archive.getmembers() if member.isfile()}
            _check(archive, members)
            files = sum(_restore(storage, archive, member) for member in members.values())
            with database.long_transaction() as connection:
                rows = sum(
                    _insert(connection, table, archive, members.get(f"{_TABLES}{table.name}.jsonl"), local_to)
                    for table in metadata.sorted_tables
                )
    except (tarfile.TarError, json.JSONDecodeError, EOFError) as error:
        raise ArchiveError(f"{source} is no archive of `fingersplit data export`, or it is cut off.") from error
    return Transferred(rows, files)


@contextmanager
def _opened(settings: ServiceSettings) -> Iterator[tuple[Database, Storage]]:
    shared = BlobStore(settings.storage_url, _PATIENCE) if settings.storage_url else None
    storage = Storage(settings.data_dir.absolute(), settings.cache_bytes, shared)
    held: AbstractContextManager[None] = nullcontext() if settings.cluster else storage.lock()
    storage.root.mkdir(parents=True, exist_ok=True)
    with held:
        database = Database(database_url(settings.database_url, storage.database))
        try:
            if not settings.cluster:
                database.lock()
            yield database, storage
        finally:
            database.close()


def _in_order(table: sa.Table) -> sa.Select[Any]:
    return sa.select(table).order_by(*table.primary_key.columns)


def _add_text(archive: tarfile.TarFile, name: str, text: str, scratch: Path) -> None:
    file = scratch / "part"
    file.write_text(text)
    archive.add(file, name)


def _files(storage: Storage) -> Iterator[tuple[str, Path]]:
    """Name and local path of every file that is worth keeping."""
    for folder in _FOLDERS:
        if storage.shared is not None:
            for blob in storage.shared.entries(f"{folder}/"):
                yield blob.name, storage.local(storage.root / blob.name)
        else:
            for path in sorted((storage.root / folder).rglob("*")):
                if path.is_file():
                    yield path.relative_to(storage.root).as_posix(), path


def _check(archive: tarfile.TarFile, members: dict[str, tarfile.TarInfo]) -> None:
    if _MANIFEST not in members:
        raise tarfile.TarError("no manifest")
    schema = json.loads(_opened_member(archive, members[_MANIFEST]).read())["schema"]
    if schema != HEAD:
        raise ArchiveError(
            f"The archive has tables of version {schema}, and this program writes {HEAD}; export and import with the "
            "same version of fingersplit-service."
        )


def _restore(storage: Storage, archive: tarfile.TarFile, member: tarfile.TarInfo) -> bool:
    """Write a file of the archive, unless it is there; whether it was written."""
    name = member.name.removeprefix(_FILES)
    path = storage.root / name
    if name == member.name or not path.resolve().is_relative_to(storage.root.resolve()):
        return False
    if name.split("/")[0] not in _FOLDERS or storage.exists(path):
        return False
    storage.staging.mkdir(exist_ok=True)
    with storage.atomic(path) as staged, staged.open("wb") as target:
        shutil.copyfileobj(_opened_member(archive, member), target)
    return True


def _insert(
    connection: sa.Connection,
    table: sa.Table,
    archive: tarfile.TarFile,
    member: tarfile.TarInfo | None,
    local_to: str | None,
) -> int:
    """Insert the rows of a table that are not there; how many."""
    inserted = 0
    for line in _opened_member(archive, member) if member else ():
        row = json.loads(line) | {name: None for name in _NOBODY if name in table.c}
        if row.get("state") == "running":
            row["state"] = "queued"
        if local_to is not None and row.get("owner") == LOCAL_OWNER:
            row["owner"] = local_to
        unique = [column.name for column in table.primary_key.columns]
        if unique == ["number"]:  # the order of acceptance: counted anew
            del row["number"]
            unique = ["owner", "id"] if table is objects else ["id"]
        inserted += insert_missing(connection, table, row, unique)
    return inserted


def _opened_member(archive: tarfile.TarFile, member: tarfile.TarInfo) -> IO[bytes]:
    file = archive.extractfile(member)
    if file is None:
        raise tarfile.TarError(f"{member.name} is not a file")
    return file
