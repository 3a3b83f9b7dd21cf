"""A service whose jobs do nothing, or wait, so that the service itself is measured: `serve` or `worker`.

A job's ``starts`` says how many milliseconds it takes, but for the first; its result, whether its object was warm.
"""

import json
import sys
import time
from functools import lru_cache
from typing import Any

from fingersplit_service.app import create_app, create_worker_app
from fingersplit_service.database.result_row import JobResultRow
from fingersplit_service.jobs.outcome import JobOutcome
from fingersplit_service.jobs.planning import PlanTask
from fingersplit_service.jobs.worker_functions import WarmUpReport, WorkerFunctions
from fingersplit_service.listening import serve_app
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["READS_ANEW", "main"]

READS_ANEW = 7
"""Seed of a job that reads its object from where it is shared."""

_HAND: dict[str, Any] = {
    "name": "barrett",
    "title": "A hand",
    "fingers": [{"name": "finger1", "joints": ["finger1_base"], "pad_radius": 0.01}],
    "joints": [{"name": "finger1_base", "lower": 0.0, "upper": 2.4}],
}
_CATALOGS: dict[str, list[dict[str, Any]]] = {
    "sources": [{"name": "antipodal", "meaning": "A source."}],
    "protocols": [{"name": "lift", "meaning": "A protocol.", "numbers": {}}],
    "controllers": [
        {"name": name, "meaning": "A controller.", "numbers": {}} for name in ("position_servo", "virtual_frame")
    ],
}


def _warm() -> WarmUpReport:
    return WarmUpReport([_HAND], catalogs=_CATALOGS)


@lru_cache(maxsize=8)  # as many as a real worker keeps ready
def _object(_object_id: str) -> None:
    """Stands for an object that a worker has ready."""


def _plan(storage: Storage, task: PlanTask) -> JobOutcome:
    if task.request.seed == READS_ANEW:
        shape = storage.shape(task.request.object_id)
        if storage.shared is not None:
            shape.unlink(missing_ok=True)
        storage.local(shape)
    before = _object.cache_info().hits
    _object(task.request.object_id)
    warm = _object.cache_info().hits > before
    if task.request.starts > 1:
        time.sleep(1e-3 * task.request.starts)
    return JobOutcome(JobResultRow(json.dumps({"warm": warm, "grasps": []}), 0, 0, 0, None))


def main() -> None:
    """Serve or work as the environment's settings say."""
    functions = WorkerFunctions(warm=_warm, plan=_plan)
    create = create_worker_app if sys.argv[1] == "worker" else create_app
    settings = ServiceSettings()
    serve_app(create(settings, functions), settings)


if __name__ == "__main__":
    main()
