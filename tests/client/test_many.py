"""Plans for many files: bounded, saved as they end, taken up again where they were."""

import asyncio
import io
import sys
from pathlib import Path
from typing import Any

import pytest

from client_calls import items, opened
from fingersplit_client import (
    AsyncClient,
    AuthenticationError,
    Client,
    InvalidRequestError,
    PlanResult,
    RequestTimeout,
    Retries,
    ServiceUnreachable,
)
from job_documents import problem_document
from scripted_server import answers, says_nothing, scripted_server
from waiting_service import WaitingService

pytestmark = pytest.mark.anyio


@pytest.fixture(params=[Client, AsyncClient])
def kind(request: pytest.FixtureRequest) -> Any:
    return request.param


@pytest.fixture
def meshes(tmp_path: Path) -> list[Path]:
    paths = [tmp_path / f"mesh{number}.off" for number in range(6)]
    for number, path in enumerate(paths):
        path.write_bytes(b"OFF %d" % number)
    return paths


async def test_each_file_has_its_result_and_so_many_are_in_work(kind: Any, meshes: list[Path], tmp_path: Path) -> None:
    service = WaitingService(succeed_at_once=True)
    with scripted_server(service) as server:
        async with opened(kind, server.url) as client:
            planned = await items(client.plan_many([*meshes, tmp_path / "none.off"], at_once=3, starts=4))
    assert sorted(one.path for one in planned) == sorted([*meshes, tmp_path / "none.off"])
    failed = [one for one in planned if one.result is None]
    assert [(one.path.name, type(one.error)) for one in failed] == [("none.off", FileNotFoundError)]
    assert service.most_at_once <= 3
    assert set(service.states.values()) == {"succeeded"}


async def test_a_folder_is_taken_up_where_it_was(kind: Any, meshes: list[Path], tmp_path: Path) -> None:
    folder, service = tmp_path / "results", WaitingService(succeed_at_once=True)
    with scripted_server(service) as server:
        async with opened(kind, server.url) as client:
            stream = client.plan_many(meshes, folder=folder, at_once=1, starts=4)
            first = next(stream) if kind is Client else await anext(stream)
            await _close(stream)
            assert first.saved is not None
            assert PlanResult.load(first.saved) == first.result
            (folder / "mesh5-000000000000.json").write_text("no result")
            known = set(service.states)

            planned = await items(client.plan_many(meshes, folder=folder, starts=4))
            assert {one.path.name: one.resumed for one in planned}[first.path.name]
            assert all(one.saved.exists() for one in planned)
            again = await items(client.plan_many(meshes, folder=folder, starts=4))
            assert [one.resumed for one in again] == [True] * 6
            other = await items(client.plan_many(meshes[:1], folder=folder, starts=5))
            meshes[0].write_bytes(b"OFF other")
            changed = await items(client.plan_many(meshes[:1], folder=folder, starts=4))
    assert (other[0].resumed, changed[0].resumed) == (False, False)
    assert len({one.saved for one in (*again, *other, *changed)}) == 8
    assert len(service.states) <= len(known) + 5 + 3


async def test_a_killed_program_finds_the_jobs_that_it_had_queued(
    kind: Any, meshes: list[Path], tmp_path: Path
) -> None:
    """Its results were not saved, but the folder's keys name its jobs; one that was cancelled is planned anew."""
    service = WaitingService(succeed_at_once=True)
    with scripted_server(service) as server:
        async with opened(kind, server.url) as client:
            planned = await items(client.plan_many(meshes[:3], folder=tmp_path / "results"))
            for one in planned:
                one.saved.unlink()
            service.states["job1"] = "cancelled"
            again = await items(client.plan_many(meshes[:3], folder=tmp_path / "results"))
    assert all(one.result is not None and not one.resumed for one in again)
    assert len(service.states) == 4


async def test_leaving_early_cancels_what_is_under_way(kind: Any, meshes: list[Path]) -> None:
    service = WaitingService()
    with scripted_server(service) as server:
        async with opened(kind, server.url) as client:
            stream = client.plan_many(meshes, at_once=3)

            def let_one_end() -> None:
                for _ in range(3):
                    assert service.waited_for.acquire(timeout=120)
                service.set("job0", "succeeded")

            import threading

            helper = threading.Thread(target=let_one_end)
            helper.start()
            first = next(stream) if kind is Client else await anext(stream)
            await _close(stream)
            helper.join()
    assert first.result is not None
    assert set(service.states.values()) == {"succeeded", "cancelled"}
    assert list(service.states.values()).count("succeeded") == 1


async def test_a_task_that_is_cancelled_cancels_all_of_its_jobs(meshes: list[Path]) -> None:
    service = WaitingService()
    with scripted_server(service) as server:
        async with AsyncClient(server.url) as client:
            task = asyncio.create_task(items(client.plan_many(meshes, at_once=3)))
            for _ in range(3):
                assert await asyncio.to_thread(service.waited_for.acquire, timeout=120)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
    assert list(service.states.values()) == ["cancelled"] * 3


async def test_what_would_fail_for_all_ends_the_whole(kind: Any, meshes: list[Path], unused_url: str) -> None:
    refuses = answers(problem_document(401, "No key."), 401)
    with scripted_server(refuses) as server:
        async with opened(kind, server.url) as client:
            with pytest.raises(AuthenticationError):
                await items(client.plan_many(meshes))
    async with opened(kind, unused_url, retries=Retries(attempts=1)) as client:
        with pytest.raises(ServiceUnreachable):
            await items(client.plan_many(meshes))


async def test_an_answer_that_is_late_is_the_error_of_its_file(kind: Any, meshes: list[Path]) -> None:
    with scripted_server(says_nothing) as server:
        async with opened(kind, server.url, timeout=0.1) as client:
            planned = await items(client.plan_many(meshes[:2], cancel=False))
    assert [type(one.error) for one in planned] == [RequestTimeout] * 2


async def test_what_is_not_valid_is_refused_before_anything_is_done(kind: Any, unused_url: str, tmp_path: Path) -> None:
    folder = tmp_path / "results"
    async with opened(kind, unused_url) as client:
        with pytest.raises(InvalidRequestError, match="starts"):
            await items(client.plan_many([], folder=folder, starts=0))
        with pytest.raises(InvalidRequestError, match="at_once is 0"):
            await items(client.plan_many([], folder=folder, at_once=0))
    assert not folder.exists()


@pytest.mark.parametrize("rich", [True, False])
def test_progress_is_told(rich: bool, meshes: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    told = io.StringIO()
    monkeypatch.setattr(sys, "stderr", told)
    if not rich:
        for name in ("rich.console", "rich.progress"):
            monkeypatch.setitem(sys.modules, name, None)
    with scripted_server(WaitingService(succeed_at_once=True)) as server, Client(server.url) as client:
        assert len(list(client.plan_many(meshes, progress=True))) == 6
    assert "6/6" in told.getvalue()


async def _close(stream: Any) -> None:
    if hasattr(stream, "aclose"):
        await stream.aclose()
    else:
        stream.close()
