"""The application: endpoints, problem documents and limits around one runtime."""

import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version

from fastapi import Depends, FastAPI
from fastapi.middleware.cors import CORSMiddleware
from fastapi.routing import APIRoute
from fastapi_offline import FastAPIOffline

from fingersplit_service.endpoints import (
    batches,
    catalogs,
    datasets,
    events,
    exports,
    grasps,
    hands,
    health,
    jobs,
    object_lookup,
    objects,
    outcomes,
    parallel_grasps,
    plan,
    scenes,
    sessions,
    usage,
    views,
)
from fingersplit_service.endpoints.bodies import exact_json
from fingersplit_service.endpoints.forms import exact_query
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.limits import MAX_HEADER_BYTES
from fingersplit_service.openapi import DESCRIPTION, TAGS, describe
from fingersplit_service.problems import add_problem_handlers
from fingersplit_service.review import docs, pages, viewer
from fingersplit_service.runtime import running
from fingersplit_service.security.body_limit import BodyLimit
from fingersplit_service.security.http_manners import ContentDecoding, HeadAsGet
from fingersplit_service.security.middleware import (
    AccessLog,
    Authentication,
    CrossSiteGuard,
    RequestId,
    RequestLimits,
    SecurityHeaders,
)
from fingersplit_service.security.msgpack_bodies import MsgpackBodies
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.telemetry.metrics import Metrics

__all__ = ["create_app", "create_worker_app"]

_RESOURCES = (
    *(plan, object_lookup, objects, parallel_grasps, jobs, grasps, views, exports),
    *(scenes, events, outcomes, batches, datasets, hands, catalogs, usage, sessions, health),
)
_UPLOADS = re.compile(f"{objects.PATH}(/[^/]+/parallel-grasps/import)?|{hands.PATH}")
_MULTIPART_OVERHEAD = 64 * 1024  # boundaries, part headers, and the other fields [bytes]


def create_worker_app(settings: ServiceSettings, functions: WorkerFunctions | None = None) -> FastAPI:
    """Build what runs the jobs of replicas elsewhere; over HTTP it only says how it fares.

    Args:
        settings: With database and object store.
        functions: As of `create_app`.
    """
    metrics = Metrics()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with running(settings, functions or WorkerFunctions(), metrics, "work") as runtime:
            app.state.runtime = runtime
            yield

    app = FastAPI(title="Fingersplit worker", lifespan=lifespan, docs_url=None, redoc_url=None, openapi_url=None)
    app.include_router(health.router)
    add_problem_handlers(app)
    app.add_middleware(CrossSiteGuard, settings=settings)
    app.add_middleware(RequestLimits, max_requests=settings.max_connections, max_header_bytes=MAX_HEADER_BYTES)
    app.add_middleware(HeadAsGet)
    app.add_middleware(AccessLog, metrics=metrics)
    app.add_middleware(RequestId)
    return app


def create_app(settings: ServiceSettings | None = None, functions: WorkerFunctions | None = None) -> FastAPI:
    """Build the service; its workers start with the application's lifespan.

    Args:
        settings: By default those of the environment.
        functions: What the workers run; by default the planner.
    """
    chosen, metrics = settings or ServiceSettings(), Metrics()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with running(chosen, functions or WorkerFunctions(), metrics) as runtime:
            app.state.runtime = runtime
            yield

    def body_limit(method: str, path: str) -> int:
        if method == "POST" and (_UPLOADS.fullmatch(path) or path in (plan.PATH, scenes.PATH)):
            return chosen.max_upload_bytes + _MULTIPART_OVERHEAD
        return chosen.max_request_bytes

    app = FastAPIOffline(  # serves the scripts of /docs itself instead of loading them from another host
        title="Fingersplit",
        version=version("fingersplit-service"),
        summary="Grasp planning for multi-fingered hands over HTTP.",
        description=DESCRIPTION,
        openapi_tags=TAGS,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        generate_unique_id_function=_operation_id,
    )
    for resource in _RESOURCES:
        exact = [] if resource is health else [Depends(exact_query), Depends(exact_json)]
        app.include_router(resource.router, dependencies=exact)
    for router in (pages.root, pages.router, viewer.router, docs.router, pages.unknown):
        app.include_router(router)
    add_problem_handlers(app)
    # From the inside out: what is added last sees a request first.
    app.add_middleware(MsgpackBodies)
    app.add_middleware(ContentDecoding, limit_of=body_limit)
    app.add_middleware(Authentication)
    app.add_middleware(BodyLimit, limit_of=body_limit, timeout_s=chosen.body_timeout_s)
    if chosen.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=chosen.cors_origins,
            allow_methods=["*"],
            allow_headers=["Authorization", "Content-Type", "Idempotency-Key", "Last-Event-ID", "Prefer"],
            expose_headers=["Location", "Retry-After", "X-Request-ID", "Idempotent-Replayed", "Preference-Applied"],
        )
    app.add_middleware(CrossSiteGuard, settings=chosen)
    app.add_middleware(RequestLimits, max_requests=chosen.max_connections, max_header_bytes=MAX_HEADER_BYTES)
    app.add_middleware(HeadAsGet)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(AccessLog, metrics=metrics)
    app.add_middleware(RequestId)
    describe(app)
    return app


def _operation_id(route: APIRoute) -> str:
    """The function's name: what a generated client calls its method."""
    return route.name
