"""Many clients at once: nothing is lost, nothing is done twice, and HTTP costs little of what the workers can do."""

import asyncio
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fingersplit.objects.parametric import cylinder
from fingersplit_bench.service.server import Server
from fingersplit_client import AsyncClient, JobCreate, Retries
from fingersplit_service.jobs.planning import PlanTask
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.storage import Storage

__all__ = ["jobs_per_second_without_http", "measure_load"]


async def measure_load(server: Server, object_id: str, clients: int, jobs: int, starts: int) -> dict[str, float]:
    """Each of the clients creates and waits, one job after the other, until all jobs are done."""
    seeds = iter(range(jobs))
    ended: list[tuple[int, str]] = []

    async def work(client: AsyncClient) -> None:
        for seed in seeds:
            request = JobCreate(object_id=object_id, starts=starts, seed=seed, top_k=1, recording=False)
            job = await client.jobs.wait(await client.jobs.create(request, wait=60), timeout=600)
            assert job.result is not None
            assert job.result.seed == seed
            ended.append((seed, job.id))

    async with AsyncClient(server.url, timeout=120, retries=Retries(attempts=1)) as client:
        began = time.monotonic()
        await asyncio.gather(*(work(client) for _ in range(clients)))
        seconds = time.monotonic() - began
        attempts = {job.id: job.attempts async for job in client.jobs.all()}
    ids = {job_id for _, job_id in ended}
    twice = sum(attempts.get(job_id, 1) > 1 for job_id in ids) + jobs - len(ids)
    return {"jobs_per_second": jobs / seconds, "lost": jobs - len(ids & attempts.keys()), "twice": twice}


async def jobs_per_second_without_http(workers: int, jobs: int, starts: int) -> float:
    """What as many workers do when they are given the same jobs directly."""
    mesh, functions = cylinder(), WorkerFunctions()
    with TemporaryDirectory() as folder:
        storage = Storage(Path(folder))
        with storage.lock(), storage.atomic(storage.shape(mesh.content_hash)) as staged:
            np.savez(staged, vertices=mesh.vertices, faces=mesh.faces)
        pool = WorkerPool(workers, memory_bytes=2**32, recycle_bytes=2**32, warm=functions.warm, warm_deadline_s=600)
        pool.start()
        try:
            while not pool.ready:
                await asyncio.sleep(0.05)
            seeds = iter(range(jobs))

            async def work() -> None:
                async with pool.worker() as lease:
                    for seed in seeds:
                        request = JobCreate(
                            object_id=mesh.content_hash, starts=starts, seed=seed, top_k=1, recording=False
                        )
                        task = PlanTask(f"{seed}", "can", request, deadline_s=60)
                        await lease.worker.run(functions.plan, storage, task, deadline_s=60)

            began = time.monotonic()
            await asyncio.gather(*(work() for _ in range(workers)))
            return jobs / (time.monotonic() - began)
        finally:
            await pool.stop()
