"""Files and database files: whole or not there, readable by others, and a sentence when they cannot be opened."""

import os
import sqlite3

import pytest

from fingersplit_service.database.connection import Database, StorageUnavailable, database_url
from fingersplit_service.database.keys import KeyStore
from fingersplit_service.storage import Storage

pytestmark = pytest.mark.anyio


async def test_the_database_survives_power_loss_and_readers(tmp_path):
    database = Database(database_url(None, tmp_path / "jobs.sqlite3"))
    store = KeyStore(database)
    await store.create("me", ["read"])
    with sqlite3.connect(tmp_path / "jobs.sqlite3") as reader:
        assert reader.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        assert reader.execute("SELECT count(*) FROM api_keys").fetchone() == (1,)
        await store.create("you", ["read"])
    reader.close()
    database.close()


async def test_a_database_that_cannot_be_opened_says_so(tmp_path):
    with pytest.raises(StorageUnavailable, match="cannot be opened"):
        Database(database_url(None, tmp_path / "missing" / "jobs.sqlite3"))


async def test_a_file_is_there_whole_or_not_at_all(tmp_path):
    storage = Storage(tmp_path)
    path = storage.view("job", 1, "picture.png")
    with storage.lock():
        with pytest.raises(TypeError), storage.atomic(path) as staged:
            staged.write_bytes("no bytes")
        assert not path.exists()
        assert list(storage.staging.iterdir()) == []
        with storage.atomic(path) as staged:
            staged.write_bytes(b"whole")
        assert path.read_bytes() == b"whole"
        storage.staged(".left").touch()
    with storage.lock():
        assert list(storage.staging.iterdir()) == []


def test_the_oldest_files_go_when_all_take_too_much(tmp_path):
    storage = Storage(tmp_path)
    for age, job in enumerate(("newest", "middle", "oldest")):
        storage.job_folder(job).mkdir(parents=True)
        (storage.job_folder(job) / "traces.npz").write_bytes(b"x" * 1000)
        os.utime(storage.job_folder(job), (1e6 - age, 1e6 - age))
    assert storage.job_folders_beyond(3000) == []
    assert storage.job_folders_beyond(2999) == ["oldest"]
    assert storage.job_folders_beyond(1000) == ["oldest", "middle"]
    assert Storage(tmp_path / "new").job_folders_beyond(1) == []
