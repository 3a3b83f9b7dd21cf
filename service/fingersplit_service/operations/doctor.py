"""Looks at an installation and says what is wrong with it."""

import asyncio
import os
import platform
import shutil
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass
from uuid import uuid4

import sqlalchemy as sa

from fingersplit_service.blobs import BlobStore
from fingersplit_service.database.connection import Database, StorageUnavailable, database_url
from fingersplit_service.database.keys import KeyStore
from fingersplit_service.database.schema import HEAD, schema_version
from fingersplit_service.operations.exposure import Exposed, refuse_exposure
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import DataDirectoryInUse, Storage

__all__ = ["Check", "examine"]

_MIN_DISK = 2**30  # [bytes]


@dataclass(frozen=True)
class Check:
    """One thing that was looked at: whether it is fine, and what was seen or is to be done."""

    what: str
    fine: bool
    detail: str


def examine(settings: ServiceSettings) -> list[Check]:
    """Look at everything that a service with these settings needs."""
    looks: list[Callable[[ServiceSettings], Check]] = [
        _python,
        _cores,
        _data_directory,
        _disk,
        _database,
        _object_store,
        _keys,
        _port,
        _planner,
    ]
    checks = []
    for look in looks:
        try:
            checks.append(look(settings))
        except Exception as error:
            checks.append(Check(look.__name__.strip("_").replace("_", " "), False, f"{error}"))
    return checks


def _python(_settings: ServiceSettings) -> Check:
    return Check("Python", sys.version_info >= (3, 11), f"{platform.python_version()}; 3.11 or newer is needed")


def _cores(settings: ServiceSettings) -> Check:
    cores = os.cpu_count() or 1
    return Check("cores", settings.workers <= cores, f"{cores} for {settings.workers} workers")


def _data_directory(settings: ServiceSettings) -> Check:
    storage = Storage(settings.data_dir.absolute())
    try:
        with storage.lock():
            with storage.atomic(storage.root / "doctor.txt") as staged:
                staged.write_text("This can be written.")
            (storage.root / "doctor.txt").unlink()
    except DataDirectoryInUse:
        return Check("data directory", True, f"{storage.root}, in use by a running service")
    except OSError as error:
        return Check("data directory", False, f"{storage.root} cannot be written: {error.strerror}")
    return Check("data directory", True, f"{storage.root} can be written")


def _disk(settings: ServiceSettings) -> Check:
    free = shutil.disk_usage(settings.data_dir).free
    return Check("free disk", free >= _MIN_DISK, f"{free >> 20} MiB; at least {_MIN_DISK >> 20} MiB are wanted")


def _database(settings: ServiceSettings) -> Check:
    try:
        database = Database(database_url(settings.database_url, Storage(settings.data_dir).database))
    except StorageUnavailable as error:
        return Check("database", False, str(error))
    try:
        version = schema_version(database.engine)
        fault = None
        if database.engine.dialect.name == "sqlite":
            with database.engine.connect() as connection:
                answer = connection.execute(sa.text("PRAGMA quick_check(1)")).scalar()
                fault = None if answer == "ok" else answer
        name = f"{database.engine.dialect.name}, tables of version {version}"
        return Check("database", fault is None and version == HEAD, f"{name}; {fault}" if fault else name)
    finally:
        database.close()


def _object_store(settings: ServiceSettings) -> Check:
    if settings.storage_url is None:
        return Check("object store", True, "none; one machine keeps its files in the data directory")
    storage = Storage(settings.data_dir.absolute(), shared=BlobStore(settings.storage_url))
    probe, name = storage.root / "doctor.txt", f"doctor/{uuid4().hex}"
    probe.write_text("This can be written.")
    try:
        assert storage.shared is not None
        storage.shared.put(name, probe)
        storage.shared.get(name, probe)
        storage.shared.delete([name])
    except OSError as error:
        return Check("object store", False, f"{settings.storage_url}: {error}")
    finally:
        probe.unlink()
    return Check("object store", True, f"{settings.storage_url} can be read and written")


def _keys(settings: ServiceSettings) -> Check:
    database = Database(database_url(settings.database_url, Storage(settings.data_dir).database))
    try:
        store = KeyStore(database)
        active = sum(row.revoked_at is None for row in asyncio.run(store.all()))
        asyncio.run(refuse_exposure(settings, store))
    except Exposed as error:
        return Check("API keys", False, str(error))
    finally:
        database.close()
    return Check("API keys", True, f"{active} active, listening on {settings.host}")


def _port(settings: ServiceSettings) -> Check:
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((settings.host, settings.port))
        except OSError as error:
            return Check("port", False, f"{settings.host}:{settings.port}: {error.strerror}")
    return Check("port", True, f"{settings.host}:{settings.port} is free")


def _planner(_settings: ServiceSettings) -> Check:
    # Imported here, because it loads the numeric stack.
    from fingersplit.cli.warming import kernels_are_compiled
    from fingersplit.hands.hand import available_hands, load_hand

    hands = [load_hand(name).name for name in available_hands()]
    compiled = "compiled" if kernels_are_compiled() else "to be compiled, which `fingersplit warm` does"
    return Check("planner", bool(hands), f"hands: {', '.join(hands)}; kernels {compiled}")
