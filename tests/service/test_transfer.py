"""From one machine to several: everything goes along, and a second time changes nothing."""

import tarfile

import pytest
from conftest import started, started_cluster
from fake_workers import FINE, HANGS

from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.database.keys import KeyStore
from fingersplit_service.operations.transfer import ArchiveError, export_data, import_data
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import DataDirectoryInUse

pytestmark = pytest.mark.anyio


async def test_jobs_objects_and_keys_move_to_several_machines(postgresql, tmp_path):
    alone, archive, url = tmp_path / "alone", tmp_path / "all.tar", postgresql()
    old = ServiceSettings(data_dir=alone)
    async with started(alone) as api:
        done = await api.queue(FINE, starts=7)
        await api.ended(done)
        picture = (await api.http.get(f"/v1/jobs/{done}/grasps/1/picture.png")).content
        object_id = await api.object_id()
        waiting = await api.queue(HANGS, deadline_s=0.5)
        with pytest.raises(DataDirectoryInUse):
            export_data(old, archive)
    written = export_data(old, archive)
    assert written.files >= 2

    settings = {"database_url": url, "storage_url": f"file://{tmp_path}/shared", "data_dir": tmp_path / "import"}
    database = Database(database_url(url, tmp_path))
    key = await KeyStore(database).create("mine", ["read", "plan", "admin"])
    database.close()
    new = ServiceSettings(**settings)
    added = import_data(new, archive, local_to=key.split("_")[1])
    assert added.files == written.files
    assert import_data(new, archive, local_to=key.split("_")[1]).files == 0
    async with started_cluster(tmp_path, url) as (api,):
        api.http.headers["Authorization"] = f"Bearer {key}"
        job = await api.job(done)
        assert (job["state"], job["result"]["starts"], job["object_id"]) == ("succeeded", 7, object_id)
        assert (await api.http.get(f"/v1/jobs/{done}/grasps/1/picture.png")).content == picture
        assert (await api.ended(waiting))["error"]["code"] == "deadline_exceeded"  # it was run
        again = await api.http.post("/v1/jobs", json={"object_id": object_id, "hand": FINE})
        assert (await api.ended(again.json()["id"]))["state"] == "succeeded"
        listed = (await api.http.get("/v1/jobs")).json()["items"]
        assert [one["id"] for one in listed] == [again.json()["id"], waiting, done]


def test_what_is_no_archive_is_refused(tmp_path):
    settings = ServiceSettings(data_dir=tmp_path / "data")
    file = tmp_path / "file.tar"
    file.write_bytes(b"nothing of ours")
    with pytest.raises(ArchiveError, match="no archive"):
        import_data(settings, file)
    other = tmp_path / "manifest.json"
    other.write_text('{"schema": "0001"}')
    with tarfile.open(file, "w") as archive:
        archive.add(other, "manifest.json")
    with pytest.raises(ArchiveError, match="0001"):
        import_data(settings, file)


def test_an_archive_writes_nothing_outside_the_data(tmp_path):
    settings = ServiceSettings(data_dir=tmp_path / "data")
    archive = tmp_path / "all.tar"
    export_data(settings, archive)
    evil = tmp_path / "evil"
    evil.write_text("x")
    with tarfile.open(archive, "a") as appended:
        for name in ("files/../../outside", "files/objects/../../../outside", "files/fingersplit.sqlite3"):
            appended.add(evil, name)
    assert import_data(settings, archive).files == 0
    assert not (tmp_path / "outside").exists()
