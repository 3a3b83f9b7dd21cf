"""The application: endpoints, problem documents and limits around one runtime."""

import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from fastapi_offline import FastAPIOffline

from fingersplit_service.endpoints import (
    batches,
    events,
    grasps,
    hands,
    health,
    jobs,
    objects,
    parallel_grasps,
    sessions,
)
from fingersplit_service.jobs.tasks import Tasks
from fingersplit_service.openapi import DESCRIPTION, TAGS, describe
from fingersplit_service.operations.metrics import Metrics
from fingersplit_service.problems import add_problem_handlers
from fingersplit_service.review import exports, pages, viewer, views
from fingersplit_service.runtime import running
from fingersplit_service.security.body_limit import BodyLimit
from fingersplit_service.security.guard import Guard
from fingersplit_service.settings import ServiceSettings

__all__ = ["create_app"]

_UPLOADS = re.compile(f"{objects.PATH}(/[^/]+/parallel-grasps/import)?")
_MULTIPART_OVERHEAD = 64 * 1024  # boundaries, part headers, and the other fields [bytes]


def create_app(settings: ServiceSettings | None = None, tasks: Tasks | None = None) -> FastAPI:
    """Build the service; its workers start with the application's lifespan.

    Args:
        settings: By default those of the environment.
        tasks: What the workers run; by default the planner.
    """
    chosen, metrics = settings or ServiceSettings(), Metrics()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with running(chosen, tasks or Tasks(), metrics) as runtime:
            app.state.runtime = runtime
            yield

    def body_limit(method: str, path: str) -> int:
        if method == "POST" and _UPLOADS.fullmatch(path):
            return chosen.max_upload_bytes + _MULTIPART_OVERHEAD
        return chosen.max_request_bytes

    app = FastAPIOffline(  # serves the scripts of /docs itself instead of pointing at somebody else's host
        title="Fingersplit",
        version="0.1.0",
        summary="Grasp planning for multi-fingered hands over HTTP.",
        description=DESCRIPTION,
        openapi_tags=TAGS,
        lifespan=lifespan,
        redoc_url=None,
    )
    for resource in (objects, parallel_grasps, jobs, grasps, views, exports, events, batches, hands, sessions, health):
        app.include_router(resource.router)
    for part in (pages, viewer):
        app.include_router(part.router)
    add_problem_handlers(app)
    app.add_middleware(BodyLimit, limit_of=body_limit, timeout_s=chosen.body_timeout_s)
    app.add_middleware(Guard, settings=chosen, metrics=metrics)
    describe(app)
    return app
