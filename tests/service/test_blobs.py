"""Files in an object store, in a folder and in an S3-compatible server."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import httpx2
import pytest
from test_faults import wait_until

from fingersplit_service.blobs import BlobStore, BlobsUnavailable
from fingersplit_service.operations.doctor import examine
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage


@pytest.fixture(scope="module")
def s3() -> Iterator[tuple[str, subprocess.Popen]]:
    """Address of a bucket, and the server's process."""
    import socket

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen([sys.executable, "-m", "moto.server", "-p", str(port)], **quiet)

    def made() -> bool:
        try:
            return httpx2.put(f"http://127.0.0.1:{port}/bucket").status_code == 200
        except httpx2.TransportError:
            return False

    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{port}")
        for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
            environment.setenv(name, "none")
        environment.setenv("AWS_REGION", "us-east-1")
        try:
            wait_until(made)
            yield "s3://bucket/folder", process
        finally:
            process.kill()
            process.wait()


@pytest.fixture(params=["folder", "s3"])
def blobs(request, tmp_path) -> BlobStore:
    if request.param == "folder":
        return BlobStore(f"file://{tmp_path}/blobs", retry_s=1)
    return BlobStore(request.getfixturevalue("s3")[0], retry_s=1)


def test_a_file_comes_back_and_goes(blobs, tmp_path):
    file, copy = tmp_path / "file", tmp_path / "there" / "copy"
    file.write_bytes(b"content" * 1000)
    blobs.put("a/b.bin", file)
    assert blobs.exists("a/b.bin")
    blobs.get("a/b.bin", copy)
    assert copy.read_bytes() == file.read_bytes()
    assert [(one.name, one.size) for one in blobs.entries("a/")] == [("a/b.bin", 7000)]
    blobs.delete(["a/b.bin", "a/none"])
    assert not blobs.exists("a/b.bin")
    with pytest.raises(FileNotFoundError):
        blobs.get("a/b.bin", copy)
    assert [path.name for path in copy.parent.iterdir()] == ["copy"]  # and nothing unfinished


def test_two_machines_see_each_others_files(blobs, tmp_path):
    here, there = [Storage(tmp_path / name, shared=blobs) for name in ("here", "there")]
    for storage in (here, there):
        storage.staging.mkdir(parents=True)
    with here.atomic(here.shape("one")) as staged:
        staged.write_bytes(b"shape")
    view = here.view("job", 1, "picture.png")
    with here.atomic(view) as staged:
        staged.write_bytes(b"picture")
    assert there.exists(there.shape("one"))
    assert there.local(there.shape("one")).read_bytes() == b"shape"
    there.claim(there.shape("one"))
    third = Storage(tmp_path / "third", shared=blobs)
    third.claim(third.shape("one"))  # which has not even the folder
    assert third.shape("one").read_bytes() == b"shape"
    with pytest.raises(FileNotFoundError):
        third.claim(third.shape("none"))
    assert not third.exists(third.shape("none"))
    assert there.objects_before(4e9) == ["one"]
    assert there.job_folders_before(4e9) == ["job"]
    assert there.job_folders_beyond(0) == ["job"]
    there.remove_job("job")
    there.remove_object("one")
    assert not here.exists(view)
    assert not here.exists(here.shape("one"))


def test_copies_are_forgotten_by_their_last_use(tmp_path):
    storage = Storage(tmp_path / "data", 10, BlobStore(f"file://{tmp_path}/blobs"))
    for number in range(3):
        path = storage.shape(f"object{number}")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"12345")
        os.utime(path, (number, number))
    storage.local(storage.shape("object0"))  # used just now
    storage.forget_copies()
    assert sorted(path.stem for path in path.parent.iterdir()) == ["object0", "object2"]


def test_the_doctor_looks_at_the_object_store(tmp_path):
    shared = {"database_url": "postgresql://nobody@127.0.0.1:1/none", "data_dir": tmp_path / "data"}
    (tmp_path / "data").mkdir()
    (tmp_path / "file").touch()
    for url, fine in ((f"file://{tmp_path}/blobs", True), (f"file://{tmp_path}/file/below", False)):
        checks = {check.what: check for check in examine(ServiceSettings(storage_url=url, **shared))}
        assert checks["object store"].fine is fine


def test_a_store_that_is_gone_is_told_as_that(s3, tmp_path):
    url, process = s3
    blobs = BlobStore(url, retry_s=0.5)
    file = tmp_path / "file"
    file.touch()
    process.send_signal(signal.SIGKILL)
    process.wait()
    for act in (lambda: blobs.put("x", file), lambda: blobs.get("x", file), lambda: blobs.exists("x")):
        with pytest.raises(BlobsUnavailable):
            act()
