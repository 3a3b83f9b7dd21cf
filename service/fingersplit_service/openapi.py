"""The description of the interface, with what only the planner knows."""

from dataclasses import fields
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from fingersplit.splitting.settings import PlannerSettings
from fingersplit_client.schemas import Problem
from fingersplit_service.endpoints.plan import PLAN_FORM, PlanCreate

__all__ = ["DESCRIPTION", "TAGS", "describe"]

DESCRIPTION = """\
Upload a mesh or a point cloud, queue a job, get ranked grasps: palm pose, joint angles and contacts.

* Lengths are in metres, angles in radians, forces in newtons, times in seconds or, where a name says so,
  milliseconds.
* Points and directions are in the object frame, the frame of the uploaded file. Surface normals point out of
  the object.
* Quaternions are `wxyz`, unit length, and rotate from the palm frame to the object frame.
* Once the service has API keys, every request needs one, as `Authorization: Bearer KEY`; a key sees only what was
  made with it.
* Bodies and answers are JSON, or MessagePack with `Content-Type` and `Accept: application/msgpack`; binary values
  there stand for base64.
* Every error is a problem document (RFC 9457) with a stable `type`.
"""
TAGS = [
    {"name": "objects", "description": "Meshes and point clouds to plan for. Equal ones are one object."},
    {"name": "jobs", "description": "Plans: queued, run by a worker process, and kept."},
    {"name": "outcomes", "description": "What became of planned grasps on robots, beside what was predicted."},
    {"name": "batches", "description": "Many jobs in one request."},
    {"name": "datasets", "description": "Many grasps of many objects in shards that can be read while more are made."},
    {"name": "hands", "description": "Hands that can be planned for: those that ship, and uploaded ones."},
    {"name": "catalogs", "description": "Metrics, file formats and sources of parallel grasps that are known."},
    {"name": "usage", "description": "What a key uses, and how much it may."},
    {"name": "sessions", "description": "For browsers, which keep a key in a cookie."},
    {"name": "health", "description": "For whoever operates the service."},
]
_MAKERS = {
    "/v1/objects": ("object_id", "id"),
    "/v1/jobs": ("job_id", "id"),
    "/v1/batches": ("batch_id", "id"),
    "/v1/datasets": ("dataset_id", "id"),
    "/v1/hands": ("hand_id", "name"),
}
"""What makes a thing: the parameter that others name it by, and the member of the answer that has it."""


def describe(app: FastAPI) -> None:
    """Complete the generated description of ``app``."""

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = _complete_schema(app)
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]  # FastAPI's documented way


def _complete_schema(app: FastAPI) -> dict[str, Any]:
    schema = get_openapi(
        title=app.title,
        version=app.version,
        summary=app.summary,
        description=app.description,
        routes=app.routes,
        tags=app.openapi_tags,
    )
    _add_links(schema["paths"])
    _mark_binary(schema["paths"])
    _drop_null(schema["paths"])
    components = schema["components"]["schemas"]
    problem = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
    plan = PlanCreate.model_json_schema(ref_template="#/components/schemas/{model}")
    components.update(problem.pop("$defs"), Problem=problem)
    components.update(plan.pop("$defs"), PlanCreate=plan, PlanForm=PLAN_FORM)
    _join_types(components)
    planner = components["JobCreate"]["properties"]["planner"]
    planner["description"] += " Known settings:\n" + "\n".join(
        f"* `{one.name}` [{one.metadata['unit'] or 'flag'}], default {one.default}: {one.metadata['doc']}"
        for one in fields(PlannerSettings)
    )
    return schema


def _mark_binary(paths: dict[str, Any]) -> None:
    """Say of answers that are neither JSON nor text that they are bytes."""
    answers = (
        answer for item in paths.values() for operation in item.values() for answer in operation["responses"].values()
    )
    for answer in answers:
        for media_type, content in answer.get("content", {}).items():
            if not media_type.startswith("text/") and "json" not in media_type:
                content["schema"] = {"type": "string", "format": "binary"}


def _drop_null(paths: dict[str, Any]) -> None:
    """Let parameters that may be left out have one type: null can be sent in no query and no header."""
    operations = (operation for item in paths.values() for operation in item.values())
    for schema in (parameter["schema"] for one in operations for parameter in one.get("parameters", [])):
        known = [kind for kind in schema.pop("anyOf", []) if kind != {"type": "null"}]
        schema.update(known[0] if len(known) == 1 else {"anyOf": known} if known else {})


def _join_types(part: Any) -> None:
    """Write plain alternatives of further members as one list of types, which more generators of clients can read."""
    for member in part.values() if isinstance(part, dict) else part if isinstance(part, list) else ():
        _join_types(member)
    further = part.get("additionalProperties") if isinstance(part, dict) else None
    if isinstance(further, dict) and all(kind.keys() == {"type"} for kind in further.get("anyOf", [{}])):
        further["type"] = [kind["type"] for kind in further.pop("anyOf")]


def _add_links(paths: dict[str, Any]) -> None:
    """Say which operations take the id of what another operation made."""
    for maker, (parameter, member) in _MAKERS.items():
        users = {
            operation["operationId"]: operation
            for path, operations in paths.items()
            for operation in operations.values()
            if f"{{{parameter}}}" in path and path != maker
        }
        links = {
            name: {
                "operationId": name,
                "parameters": {parameter: f"$response.body#/{member}"},
                "description": f"{operation['summary']}: its `{parameter}` is this answer's `{member}`.",
            }
            for name, operation in users.items()
        }
        if maker == "/v1/objects":
            plan = paths["/v1/jobs"]["post"]
            # Without `requestBody`: generators of clients refuse one that is an object with an expression in it.
            links[plan["operationId"]] = {
                "operationId": plan["operationId"],
                "description": f"{plan['summary']}: `object_id` in its body is this answer's `id`.",
            }
        for status, answer in paths[maker]["post"]["responses"].items():
            if status.startswith("2"):
                answer["links"] = links
