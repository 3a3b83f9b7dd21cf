"""A real service with the real planner: clouds, options, verification, and what it keeps of objects on disk."""

import io
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_client import ApiError, Client, JobCreate, ParallelGraspsGenerate
from one_view import one_view
from serving import serving


def wait_until(condition: Callable[[], bool], seconds: float = 180) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come to that"
        time.sleep(0.02)


@contextmanager
def served(data_dir: Path, spare_workers: int = 1) -> Iterator[Client]:
    """A client of a service with one worker."""
    settings = {"SPARE_WORKERS": str(spare_workers), "KEEP_ORPHANS_S": "1", "VERIFY_FIRST": "false"}
    environment = os.environ | {f"FINGERSPLIT_{name}": value for name, value in settings.items()}
    with serving(data_dir, "--workers", 1, environment=environment) as url, Client(url) as client:
        yield client


@pytest.fixture(scope="module")
def data_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def client(data_dir: Path) -> Iterator[Client]:
    with served(data_dir) as client:
        yield client


def mesh_of(name: str) -> bytes:
    return PARAMETRIC_OBJECTS[name]().trimesh.export(file_type="ply")


def kept_of(data_dir: Path, object_id: str) -> list[Path]:
    return sorted(path for folder in ("objects", "cache") for path in (data_dir / folder).glob(f"*{object_id}*"))


def entry(data_dir: Path, kind: str, object_id: str) -> Path:
    """The one file that the cache has of an object."""
    (path,) = (data_dir / "cache").glob(f"{kind}-{object_id}-*.arrays")
    return path


def poses(result: Any) -> list[Any]:
    return [(grasp.palm, grasp.joints) for grasp in result.grasps]


def test_a_cloud_is_grasped(client):
    cloud, file = one_view(PARAMETRIC_OBJECTS["cylinder"](), (1.0, 0.4, 0.6)), io.BytesIO()
    np.savez(file, points=1e3 * cloud.points)
    uploaded = client.objects.upload(
        file.getvalue(), file_type="npz", unit="mm", viewpoint=(1e3 * cloud.viewpoint).tolist(), name="seen can"
    )
    assert uploaded.report.viewpoint
    job = client.jobs.wait(client.jobs.create(JobCreate(object_id=uploaded.id, starts=32)))
    assert job.result.object.seen < 1
    assert job.result.object.id == uploaded.id
    assert job.result.summary.feasible > 0
    assert job.result.grasps[0].feasible
    assert client.jobs.picture(job.id).startswith(b"\x89PNG")


def test_what_was_said_of_an_object_counts(client):
    uploaded = client.objects.upload(mesh_of("cylinder"), file_type="ply", mass=0.35, friction=1)
    job = client.jobs.wait(client.jobs.create(JobCreate(object_id=uploaded.id, starts=8, source="both")))
    assert job.result.object.mass == 0.35
    assert job.result.object.id == uploaded.id != client.objects.upload(mesh_of("cylinder"), file_type="ply").id


def test_paper_fidelity_can_be_asked_for(client):
    uploaded = client.objects.upload(mesh_of("cylinder"), file_type="ply")
    asked = JobCreate(object_id=uploaded.id, starts=8, planner={"fidelity": "paper"})
    job = client.jobs.wait(client.jobs.create(asked))
    assert job.result.grasps
    with pytest.raises(ApiError, match="fidelity"):
        client.jobs.create(JobCreate(object_id=uploaded.id, planner={"fidelity": "none"}))


def test_a_verified_grasp_holds(client, data_dir):
    uploaded = client.objects.upload(mesh_of("box"), file_type="ply", name="box", mass=0.1, friction=0.8)
    wait_until(lambda: any((data_dir / "cache").glob(f"pieces-{uploaded.id}-*.arrays")))  # before any job needs them
    pieces = entry(data_dir, "pieces", uploaded.id).stat().st_ino
    asked = JobCreate(object_id=uploaded.id, starts=32, verified=1, verify_initial=True, simulated_friction=0.75)
    job = client.jobs.wait(client.jobs.create(asked))

    assert job.verified == 1
    assert job.result.summary.verification.held == 1
    reports = client.jobs.verification(job.id)
    assert (reports.asked, reports.verified) == (1, 1)
    best = next(report for report in reports.grasps if report.verification.passed)
    assert best.verification.settings["friction"] == [0.75, 0.75, 0.75]
    assert best.verification.settings["planned_friction"] == job.result.friction == 0.8
    assert best.verification.settings["mass"] == 0.1
    assert best.initial.protocol == best.verification.protocol == "lift"
    assert entry(data_dir, "pieces", uploaded.id).stat().st_ino == pieces


def test_parallel_grasps_come_from_every_source(client):
    uploaded = client.objects.upload(mesh_of("cylinder"), file_type="ply")
    found = {
        source: client.parallel_grasps.generate(uploaded.id, ParallelGraspsGenerate(count=4, source=source))
        for source in ("antipodal", "surface_fitting", "both")
    }
    assert all(one.count > 0 for one in found.values())
    assert len({str(one.parallel_grasps) for one in found.values()}) == 3


def test_parallel_grasps_are_found_for_the_friction_of_the_object(client):
    slippery = client.objects.upload(mesh_of("ellipsoid"), file_type="ply", friction=0.05)
    rough = client.objects.upload(mesh_of("ellipsoid"), file_type="ply", friction=1.0)

    def found(object_id: str, friction: float | None = None) -> Any:
        request = ParallelGraspsGenerate(count=16, friction=friction)
        return client.parallel_grasps.generate(object_id, request).parallel_grasps

    assert found(slippery.id) == found(slippery.id, 0.05) == found(rough.id, 0.05)
    assert found(rough.id) == found(rough.id, 1.0) != found(slippery.id)


def test_a_deleted_object_leaves_no_file(client, data_dir):
    uploaded = client.objects.upload(mesh_of("mug"), file_type="ply", mass=0.2)
    client.objects.mesh(uploaded.id, "stl")
    wait_until(lambda: any((data_dir / "cache").glob(f"pieces-{uploaded.id}-*.arrays")))
    assert len(kept_of(data_dir, uploaded.id)) == 4  # shape, export, prepared object, pieces
    client.objects.delete(uploaded.id)
    wait_until(lambda: kept_of(data_dir, uploaded.id) == [])

    again = client.objects.upload(mesh_of("mug"), file_type="ply", mass=0.2)
    client.objects.delete(again.id)  # while or before its pieces are computed
    other = client.objects.upload(mesh_of("box"), file_type="ply", mass=0.3)
    wait_until(lambda: any((data_dir / "cache").glob(f"pieces-{other.id}-*.arrays")))  # which comes after
    wait_until(lambda: kept_of(data_dir, again.id) == [])


def test_a_restarted_service_loads_what_was_prepared_and_repairs_what_was_damaged(tmp_path):
    with served(tmp_path, spare_workers=0) as client:
        object_id = client.objects.upload(mesh_of("cylinder"), file_type="ply").id
        order = JobCreate(object_id=object_id, starts=8, seed=4)
        first = client.jobs.wait(client.jobs.create(order)).result
    kept = entry(tmp_path, "object", object_id)
    prepared = kept.stat().st_ino, kept.read_bytes()

    with served(tmp_path, spare_workers=0) as client:
        assert poses(client.jobs.wait(client.jobs.create(order)).result) == poses(first)
    assert kept.stat().st_ino == prepared[0]

    damaged = bytearray(prepared[1])
    damaged[len(damaged) // 2] ^= 0xFF
    kept.write_bytes(damaged)
    with served(tmp_path, spare_workers=0) as client:
        assert poses(client.jobs.wait(client.jobs.create(order)).result) == poses(first)
    assert kept.read_bytes() == prepared[1]
    assert kept.stat().st_ino != prepared[0]


def test_a_job_that_comes_before_the_convex_pieces_computes_them_itself(tmp_path):
    with served(tmp_path, spare_workers=0) as client:
        object_id = client.objects.upload(mesh_of("cylinder"), file_type="ply").id
        histories, pieces = [], set()
        for _ in range(2):
            job = client.jobs.create(JobCreate(object_id=object_id, starts=8, verified=1))
            histories.append([event.job for event in client.jobs.events(job.id)])
            assert histories[-1][-1].verified == 1
            pieces.add(entry(tmp_path, "pieces", object_id).stat().st_ino)
    assert "convex_pieces" in [job.stage for job in histories[0]]
    assert len(pieces) == 1
