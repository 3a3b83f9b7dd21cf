"""Documents of jobs as the service sends them, for servers that follow a script."""

from typing import Any


def job_document(state: str = "queued", **members: Any) -> dict[str, Any]:
    """A job without a result."""
    return {
        "id": "a/b",
        "object_id": "x",
        "object_name": "mug",
        "hand": "barrett",
        "state": state,
        "stage": None,
        "progress": 0.0,
        "priority": 0,
        "attempts": 1,
        "batch_id": None,
        "grasps": None,
        "feasible": None,
        "verified": None,
        "holding_margin": None,
        "created_at": "2026-01-01T00:00:00Z",
        "started_at": None,
        "finished_at": None,
        "request": {"object_id": "x"},
        "error": None,
        "warnings": [],
        "result": None,
    } | members


def summary_document(state: str = "queued", **members: Any) -> dict[str, Any]:
    """The same as events carry it."""
    return {name: value for name, value in job_document(state, **members).items() if name not in ("request", "result")}


def problem_document(status: int, detail: str = "It is so.", **members: Any) -> dict[str, Any]:
    return {"type": f"urn:fingersplit:problem:{status}", "title": "No", "status": status, "detail": detail} | members
