"""Several machines on one PostgreSQL and one object store: any replica answers for any job, and none is lost."""

import asyncio
import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import anyio
import httpx2
import pytest
import sqlalchemy as sa
import typer
from conftest import PATIENCE, cube_file, started_cluster
from fake_workers import FINE, HANGS, HANGS_ONCE, WAITS
from sqlalchemy.exc import DatabaseError
from test_datasets import begin_rounds, begun, cubes, filled, rounds
from test_faults import SERVER, children, wait_until
from test_store import OBJECT, JobStore, ObjectStore
from test_waiting import events_of

from fingersplit_service.cli import _refuse_start
from fingersplit_service.database.cluster_queue import ClusterQueue
from fingersplit_service.database.connection import Database, StorageUnavailable, database_url
from fingersplit_service.database.result_row import JobResultRow
from fingersplit_service.database.rows import NewJob
from fingersplit_service.jobs.agent import Agent
from fingersplit_service.settings import ServiceSettings

FOUND = JobResultRow(result="[1]", grasps=1, feasible=1, verified=0, holding_margin=0.5)


@pytest.fixture(scope="module")
async def two(postgresql, tmp_path_factory, anyio_backend):
    """Two replicas and two agents."""
    folder = tmp_path_factory.mktemp("two")
    async with started_cluster(folder, postgresql(), replicas=2, agents=2) as apis:
        yield apis


@pytest.fixture
def database(postgresql, tmp_path):
    """Of several machines, empty."""
    opened = Database(database_url(postgresql(), tmp_path))
    yield opened
    opened.close()


@pytest.mark.anyio
async def test_any_replica_answers_for_any_job(two):
    here, there = two
    here.hold()
    job_id = await here.queue(WAITS)
    waiting = asyncio.create_task(there.http.get(f"/v1/jobs/{job_id}", headers={"Prefer": f"wait={PATIENCE}"}))
    following = asyncio.create_task(there.http.get(f"/v1/jobs/{job_id}/events"))
    await here.begun(job_id)
    here.go()
    assert (await waiting).json()["state"] == "succeeded"
    states = [name for _, name, _ in events_of((await following).text)]
    assert (states[0], states[-1]) == ("queued", "succeeded")
    for api in two:
        picture = await api.http.get(f"/v1/jobs/{job_id}/grasps/1/picture.png")
        assert picture.status_code == 200
        assert (await api.http.get(f"/v1/objects/{await here.object_id()}/mesh")).status_code == 200


@pytest.mark.anyio
async def test_an_object_uploaded_again_at_another_replica_stays_whole(two):
    here, there = two
    kept = here.data_dir / "shared" / "objects"
    answers, sizes = [], []
    for api in (here, there, here):
        answers.append(await api.upload(cube_file(7), "cube.off", unit="cm"))
        sizes.append((kept / f"{answers[-1].json()['id']}.npz").stat().st_size)
    assert [answer.status_code for answer in answers] == [201, 200, 200]
    assert len({answer.json()["id"] for answer in answers}) == 1
    assert len(set(sizes)) == 1
    assert sizes[0] > 0


@pytest.mark.anyio
async def test_a_job_is_cancelled_by_the_other_replica(two):
    here, there = two
    job_id = await here.queue(HANGS)
    await here.begun(job_id)
    assert (await there.http.post(f"/v1/jobs/{job_id}/cancel")).json()["state"] == "cancelled"
    assert (await here.ended(await here.queue(FINE)))["state"] == "succeeded"


@pytest.mark.anyio
async def test_one_key_at_two_replicas_is_one_job(two):
    body, headers = {"object_id": await two[0].object_id(), "hand": FINE}, {"Idempotency-Key": "two-replicas"}
    calls = [api.http.post("/v1/jobs", json=body, headers=headers) for api in two for _ in range(4)]
    answers = await asyncio.gather(*calls)
    assert {answer.status_code for answer in answers} <= {200, 202}
    assert len({answer.json()["id"] for answer in answers}) == 1


@pytest.mark.anyio
async def test_a_data_set_is_filled_once_whoever_answers(two):
    here, there = two
    asked = await begun(here, await cubes(here, 2))
    found = await filled(there, asked["id"])
    assert (found["state"], found["done"], found["selected"]) == ("complete", 2, 4)
    jobs = [await there.job(one["id"]) for one in await rounds(here, asked["id"])]
    assert sorted((job["object_id"], job["request"]["seed"]) for job in jobs) == sorted(
        (item["object_id"], seed) for item in found["items"] for seed in (7, 8)
    )
    shards = [await api.http.get(f"/v1/datasets/{asked['id']}/shards/1/0") for api in two]
    assert [shard.content for shard in shards] == [b"shard 1 0"] * 2
    hanging = await begun(here, await cubes(here, 1), HANGS)
    await begin_rounds(there, hanging["id"], 1)
    assert (await there.http.post(f"/v1/datasets/{hanging['id']}/cancel")).json()["state"] == "cancelled"
    assert {job["state"] for job in await rounds(here, hanging["id"])} == {"cancelled"}


@pytest.mark.anyio
async def test_characters_that_cannot_be_stored_are_refused(two):
    for path in ("/v1/jobs?object_name=%00", "/v1/jobs?hand=%00"):
        assert (await two[0].http.get(path)).status_code == 422


@pytest.mark.anyio
async def test_without_notifications_the_table_is_looked_at(postgresql, tmp_path, monkeypatch):
    """As behind a pooler that shares sessions: what is sent on one arrives nowhere."""
    monkeypatch.setattr("fingersplit_service.jobs.cluster_notifier._SEND", "SELECT %s::text[], %s::text[]")
    async with started_cluster(tmp_path, postgresql()) as (api,):
        body = {"object_id": await api.object_id(), "hand": FINE}
        answer = await api.http.post("/v1/jobs", json=body, headers={"Prefer": f"wait={PATIENCE}"})
        assert answer.json()["state"] == "succeeded"
        hanging = await api.queue(HANGS)
        await api.begun(hanging)
        with anyio.fail_after(PATIENCE):
            while (await api.job(hanging))["stage"] != "splitting":
                await anyio.sleep(0.05)
        following = asyncio.create_task(api.http.get(f"/v1/jobs/{hanging}/events"))
        assert (await api.http.post(f"/v1/jobs/{hanging}/cancel")).json()["state"] == "cancelled"
        assert events_of((await following).text)[-1][1] == "cancelled"
        assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


@contextmanager
def machine(
    folder: Path, name: str, database: str, port: int, *role: str, **settings: str
) -> Iterator[subprocess.Popen]:
    """A replica or an agent in a process group of its own."""
    environment = os.environ | {
        "FINGERSPLIT_DATABASE_URL": database,
        "FINGERSPLIT_STORAGE_URL": f"file://{folder}/shared",
        "FAKES_FOLDER": str(folder),
        **{f"FINGERSPLIT_{setting.upper()}": value for setting, value in settings.items()},
    }
    command = [sys.executable, str(SERVER), str(folder / name), str(port), *role]
    process = subprocess.Popen(command, env=environment, start_new_session=True)
    try:
        yield process
    finally:
        for signal_number in (signal.SIGCONT, signal.SIGKILL):
            if process.poll() is None:
                os.killpg(process.pid, signal_number)
        process.wait()


def ready(process: subprocess.Popen, port: int) -> None:
    def answers() -> bool:
        assert process.poll() is None
        try:
            return httpx2.get(f"http://127.0.0.1:{port}/readyz").status_code == 200
        except httpx2.TransportError:
            return False

    wait_until(answers)


@pytest.fixture
def ports(free_ports) -> list[int]:
    return free_ports(3)


@pytest.mark.parametrize("death", [signal.SIGKILL, signal.SIGSTOP])
def test_jobs_of_a_machine_that_died_or_was_stopped_are_taken_over(postgresql, tmp_path, ports, death):
    database = postgresql()
    with ExitStack() as stack:
        first = stack.enter_context(machine(tmp_path, "first", database, ports[0], "work"))
        replica = stack.enter_context(machine(tmp_path, "replica", database, ports[1]))
        ready(first, ports[0])
        ready(replica, ports[1])
        http = stack.enter_context(httpx2.Client(base_url=f"http://127.0.0.1:{ports[1]}", timeout=PATIENCE))
        files = {"file": ("c.off", cube_file(5))}
        object_id = http.post("/v1/objects", files=files, data={"unit": "cm"}).json()["id"]
        body = {"object_id": object_id, "hand": HANGS_ONCE}
        jobs = [http.post("/v1/jobs", json=body).json()["id"] for _ in range(2)]
        wait_until(lambda: len(list(tmp_path.glob("*.begun"))) == 2)
        second = stack.enter_context(machine(tmp_path, "second", database, ports[2], "work"))
        ready(second, ports[2])
        if death == signal.SIGKILL:
            os.killpg(first.pid, death)
        else:
            os.kill(first.pid, death)
        for job_id in jobs:
            job = http.get(f"/v1/jobs/{job_id}", headers={"Prefer": f"wait={PATIENCE}"}).json()
            assert (job["state"], job["attempts"]) == ("succeeded", 2)
        if death == signal.SIGSTOP:
            mine = children(first.pid)
            os.kill(first.pid, signal.SIGCONT)
            wait_until(lambda: not set(mine) <= set(children(first.pid)))  # it noticed, and ended what it ran
            assert [http.get(f"/v1/jobs/{job_id}").json()["attempts"] for job_id in jobs] == [2, 2]


def test_a_rolling_restart_answers_no_server_error_and_loses_nothing(postgresql, tmp_path, free_ports):
    """Two replicas are restarted one after the other, behind what a load balancer does.

    It asks who is ready, sends requests there, and to the other one when it gets no connection.
    """
    database, ports = postgresql(), free_ports(3)
    urls = [f"http://127.0.0.1:{port}" for port in ports[:2]]
    statuses, accepted, stop, up = Counter[int](), set[str](), threading.Event(), [True, True]
    with ExitStack() as stack:
        agent = stack.enter_context(machine(tmp_path, "agent", database, ports[2], "work"))
        start = lambda place: machine(tmp_path, f"replica{place}", database, ports[place], drain_s="1")  # noqa: E731
        replicas = [stack.enter_context(start(place)) for place in (0, 1)]
        for process, port in zip([*replicas, agent], ports, strict=True):
            ready(process, port)
        files = {"file": ("c.off", cube_file(5))}
        object_id = httpx2.post(f"{urls[0]}/v1/objects", files=files, data={"unit": "cm"}, timeout=PATIENCE).json()[
            "id"
        ]

        def probe() -> None:
            while not stop.wait(0.1):
                for place, url in enumerate(urls):
                    try:
                        up[place] = httpx2.get(f"{url}/readyz", timeout=PATIENCE).status_code == 200
                    except httpx2.TransportError:
                        up[place] = False

        def load(number: int) -> None:
            body, sent = {"object_id": object_id, "hand": FINE}, 0
            with ExitStack() as connections:
                clients = [connections.enter_context(httpx2.Client(base_url=url, timeout=PATIENCE)) for url in urls]
                while not stop.is_set():
                    sent += 1
                    headers = {"Idempotency-Key": f"{number}-{sent}", "Prefer": "wait=60"}
                    for place in itertools.count(sent):
                        if not up[place % 2]:
                            time.sleep(0.001)
                            continue
                        with suppress(httpx2.TransportError):
                            answer = clients[place % 2].post("/v1/jobs", json=body, headers=headers)
                            statuses[answer.status_code] += 1
                            accepted.add(answer.json().get("id", answer.text))
                            break
                    stop.wait(0.1)  # requests that take the whole machine make the restart take long

        threads = [threading.Thread(target=load, args=(number,)) for number in range(3)]
        threads.append(threading.Thread(target=probe))
        for thread in threads:
            thread.start()
        try:
            for place in (0, 1):
                seen = sum(statuses.values())
                wait_until(lambda seen=seen: sum(statuses.values()) > seen + 5)
                replicas[place].send_signal(signal.SIGTERM)
                assert replicas[place].wait(PATIENCE) == 0
                replicas[place] = stack.enter_context(start(place))
                ready(replicas[place], ports[place])
                wait_until(lambda place=place: up[place])
        finally:
            stop.set()
            for thread in threads:
                thread.join()
        assert set(statuses) <= {200, 202}
        with httpx2.Client(base_url=urls[0], timeout=PATIENCE) as http:
            for job_id in accepted:
                job = http.get(f"/v1/jobs/{job_id}", headers={"Prefer": f"wait={PATIENCE}"}).json()
                assert (job["state"], job["attempts"]) == ("succeeded", 1)


def test_an_agent_told_to_stop_ends_its_jobs_first(postgresql, tmp_path, ports):
    database = postgresql()
    with ExitStack() as stack:
        agent = stack.enter_context(
            machine(tmp_path, "agent", database, ports[0], "work", stop_grace_s="60", workers="1")
        )
        replica = stack.enter_context(machine(tmp_path, "replica", database, ports[1]))
        ready(agent, ports[0])
        ready(replica, ports[1])
        http = stack.enter_context(httpx2.Client(base_url=f"http://127.0.0.1:{ports[1]}", timeout=PATIENCE))
        files = {"file": ("c.off", cube_file(5))}
        object_id = http.post("/v1/objects", files=files, data={"unit": "cm"}).json()["id"]
        running = http.post("/v1/jobs", json={"object_id": object_id, "hand": WAITS}).json()["id"]
        wait_until(lambda: len(list(tmp_path.glob("*.begun"))) == 1)
        agent.send_signal(signal.SIGTERM)
        wait_until(lambda: "refused" in _refusal(ports[0]))
        later = http.post("/v1/jobs", json={"object_id": object_id, "hand": FINE}).json()["id"]
        (tmp_path / "go").touch()
        job = http.get(f"/v1/jobs/{running}", headers={"Prefer": f"wait={PATIENCE}"}).json()
        assert (job["state"], job["attempts"]) == ("succeeded", 1)
        agent.wait(PATIENCE)
        job = http.get(f"/v1/jobs/{later}").json()
        assert (job["state"], job["attempts"]) == ("queued", 0)


def _refusal(port: int) -> str:
    try:
        return httpx2.get(f"http://127.0.0.1:{port}/healthz").text
    except httpx2.TransportError:
        return "refused"


@pytest.mark.anyio
async def test_a_silent_agent_cannot_write_when_it_wakes(database):
    await ObjectStore(database).add("me", OBJECT)
    new = [NewJob(f"job{number}", "cube", "barrett", 0, None, "{}", "") for number in range(2)]
    await JobStore(database).add("me", new, longest_queue=10)
    first, second = ClusterQueue(database, "first", 1), ClusterQueue(database, "second", 1)
    await first.begin()
    await second.begin()
    mine = await first.claim()
    assert (await second.rescue(60)).queued == []
    await second.beat({})
    with database.engine.begin() as connection:
        connection.exec_driver_sql(f"UPDATE agents SET beat_at = beat_at - 100 WHERE id = '{first.agent}'")
    assert (await second.rescue(60)).queued == [mine.id]
    again = await second.claim()
    assert (again.id, again.attempts) == (mine.id, 2)
    assert not (await first.beat({mine.id: (mine.attempts, None, None)})).known
    assert await first.succeed(mine, FOUND) is None
    await first.register()
    lost = (await first.beat({mine.id: (mine.attempts, None, None)})).lost
    assert list(lost) == [mine.id]
    assert await second.succeed(again, FOUND)


@pytest.mark.anyio
async def test_an_agent_that_stands_still_within_a_transaction_is_given_up(postgresql, tmp_path, monkeypatch):
    """Its locks go with its session, which the database ends; nobody waits for them any longer than that."""
    monkeypatch.setattr("fingersplit_service.database.connection._IDLE_IN_TRANSACTION", 1_500)
    database = Database(database_url(postgresql(), tmp_path))
    try:
        await ObjectStore(database).add("me", OBJECT)
        await JobStore(database).add("me", [NewJob("job", "cube", "barrett", 0, None, "{}", "")], longest_queue=10)
        first, second = ClusterQueue(database, "first", 1), ClusterQueue(database, "second", 1)
        await first.begin()
        await second.begin()
        mine = await first.claim()
        with database.engine.begin() as connection:
            connection.exec_driver_sql(f"UPDATE agents SET beat_at = beat_at - 100 WHERE id = '{first.agent}'")
        standing = database.engine.connect()
        standing.exec_driver_sql(f"UPDATE agents SET beat_at = beat_at WHERE id = '{first.agent}'")
        rescued: list[str] = []
        with anyio.fail_after(PATIENCE):
            while not rescued:
                with suppress(StorageUnavailable):
                    rescued.extend((await second.rescue(60)).queued)
        assert rescued == [mine.id]
        with pytest.raises(DatabaseError):
            standing.exec_driver_sql("SELECT 1")
        standing.invalidate()
        standing.close()
    finally:
        database.close()


@pytest.mark.anyio
async def test_a_claim_reads_few_rows_however_many_jobs_an_owner_had(database):
    await ObjectStore(database).add("me", OBJECT)
    queue = ClusterQueue(database, "first", 1)
    await queue.begin()
    new = [NewJob(f"job{number}", "cube", "barrett", 0, None, "{}", "") for number in range(1000)]
    await JobStore(database).add("me", new, longest_queue=1000)
    with database.engine.begin() as connection:
        connection.exec_driver_sql("UPDATE jobs SET state = 'succeeded', started_at = 1 WHERE number <= 900")

    def rows_read(connection) -> int:
        """Of the jobs, by one claim."""
        counted = "SELECT seq_tup_read + idx_tup_fetch FROM pg_stat_xact_user_tables WHERE relname = 'jobs'"
        before = connection.exec_driver_sql(counted).scalar() or 0
        assert ClusterQueue.claim.__wrapped__(queue, connection, {"cube"}) is not None
        return connection.exec_driver_sql(counted).scalar() - before

    read = [await database.run(rows_read) for _ in range(10)]
    assert 0 < max(read) < 100


def test_a_long_transaction_outlives_those_that_stand_still(postgresql, tmp_path, monkeypatch):
    monkeypatch.setattr("fingersplit_service.database.connection._IDLE_IN_TRANSACTION", 500)
    database = Database(database_url(postgresql(), tmp_path))
    try:
        with database.long_transaction() as patient, database.engine.connect() as standing:
            patient.exec_driver_sql("SELECT 1")
            process = standing.exec_driver_sql("SELECT pg_backend_pid()").scalar()
            with database.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as control:
                found = f"SELECT count(*) FROM pg_stat_activity WHERE pid = {process}"
                wait_until(lambda: control.exec_driver_sql(found).scalar() == 0)
            standing.invalidate()
            assert patient.exec_driver_sql("SELECT 1").scalar() == 1
    finally:
        database.close()


@pytest.mark.anyio
async def test_a_claim_says_whether_more_jobs_wait(database):
    await ObjectStore(database).add("me", OBJECT)
    new = [NewJob(f"job{number}", "cube", "barrett", 0, None, "{}", "") for number in range(2)]
    await JobStore(database).add("me", new, longest_queue=10)
    queue = ClusterQueue(database, "this", 1)
    await queue.begin()
    said = []
    for _ in range(3):
        await queue.claim()
        said.append(queue.more)
    assert said == [True, False, False]


@pytest.mark.anyio
async def test_one_agent_looks_for_a_single_job_before_the_others(database):
    woken = []
    agents = []
    for name in ("first", "second", "third"):
        queue = ClusterQueue(database, name, 1)
        await queue.begin()
        dispatcher = SimpleNamespace(running={}, interrupt=None, wake=partial(woken.append, name))
        idle = SimpleNamespace(wake=lambda: None)
        warm = SimpleNamespace(knows_any=lambda objects: True)
        agents.append(Agent(queue, dispatcher, idle, SimpleNamespace(), warm, 3.0))
    for agent in agents:
        await agent._beat(0.0)
    assert sum(agent.leads for agent in agents) == 1
    looked_at_once = []
    for turn in range(3):
        woken.clear()
        for agent in agents:
            agent._queued(["cube"], turn)
        looked_at_once += woken
    assert sorted(looked_at_once) == ["first", "second", "third"]  # each in one turn, alone
    woken.clear()
    for agent in agents:
        agent._queued(["cube"], None)  # many jobs
    assert woken == ["first", "second", "third"]


@pytest.mark.anyio
async def test_a_claim_whose_answer_was_lost_waits_again(database, monkeypatch):
    monkeypatch.setattr("fingersplit_service.database.cluster_queue._UNKNOWN_FOR", -1.0)
    await ObjectStore(database).add("me", OBJECT)
    await JobStore(database).add("me", [NewJob("job", "cube", "barrett", 0, None, "{}", "")], longest_queue=10)
    queue = ClusterQueue(database, "this", 1)
    await queue.begin()
    assert (await queue.claim()).attempts == 1
    await queue.beat({})
    assert (await queue.claim()).attempts == 2


@pytest.mark.anyio
async def test_warm_objects_are_preferred_and_nothing_is_starved(database):
    objects = ObjectStore(database)
    for name in ("cube", "other"):
        await objects.add("me", OBJECT.model_copy(update={"id": name}))
    cold = NewJob("cold", "cube", "barrett", 0, None, "{}", "")
    warm = [NewJob(f"warm{number}", "other", "barrett", 0, None, "{}", "") for number in range(40)]
    await JobStore(database).add("me", [cold, *warm], longest_queue=100)
    queue = ClusterQueue(database, "this", 1)
    await queue.begin()
    claimed = [(await queue.claim({"other"})).id for _ in range(16)]
    assert "cold" not in claimed[:15]
    assert claimed[15] == "cold"


def test_a_start_waits_for_a_database_that_is_starting(postgresql, tmp_path, capsys, monkeypatch):
    there = sa.make_url(postgresql())
    url = there.set(database="later").render_as_string(hide_password=False)
    settings = ServiceSettings(
        database_url=url, storage_url=f"file://{tmp_path}/shared", data_dir=tmp_path / "own", database_wait_s=0
    )
    with pytest.raises(typer.Exit):
        _refuse_start(settings)
    assert "The database cannot be opened" in capsys.readouterr().err
    told = threading.Event()
    monkeypatch.setattr(typer, "echo", lambda text, **_: told.set() if "tried again" in text else None)
    with ThreadPoolExecutor() as threads:
        start = threads.submit(_refuse_start, settings.model_copy(update={"database_wait_s": PATIENCE}))
        assert told.wait(PATIENCE)
        engine = sa.create_engine(there.set(drivername="postgresql+psycopg"), isolation_level="AUTOCOMMIT")
        with engine.connect() as connection:
            connection.exec_driver_sql("CREATE DATABASE later")
        engine.dispose()
        assert start.result(PATIENCE) is None


def test_a_worker_needs_what_it_shares(service_environment, tmp_path):
    program = "from fingersplit_service.cli import worker; import typer; typer.run(worker)"
    command = [sys.executable, "-c", program, "--data-dir", str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert ended.returncode == 2
    assert "FINGERSPLIT_STORAGE_URL" in ended.stderr
