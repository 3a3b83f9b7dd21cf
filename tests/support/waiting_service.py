"""A service whose jobs go on until they are cancelled or let go, to try what clients do meanwhile."""

import json
import re
import threading
from http.server import BaseHTTPRequestHandler
from typing import Any

from fingersplit_client.schemas import ObjectInfo
from job_documents import job_document, problem_document
from plan_documents import filled, grasp, plan_result
from scripted_server import ScriptedServer, answers


class WaitingService:
    """One step for every request, by its path.

    Attributes:
        succeed_at_once: Whether jobs succeed as soon as they are waited for.
    """

    def __init__(self, *, succeed_at_once: bool = False) -> None:
        self.succeed_at_once = succeed_at_once
        self.states: dict[str, str] = {}
        self.keys: dict[str, str] = {}
        self.most_at_once = 0
        self.waited_for = threading.Semaphore(0)
        self._changed = threading.Condition()

    def __call__(self, handler: BaseHTTPRequestHandler, server: ScriptedServer) -> None:
        method, path = handler.command, handler.path
        job = re.fullmatch(r"/v1/jobs/([^/]+)(/cancel)?", path)
        if path == "/v1/objects/lookup":
            self._answer(handler, server, problem_document(404), 404)
        elif path == "/v1/objects":
            self._answer(handler, server, json.loads(ObjectInfo.model_validate(OBJECT).model_dump_json()), 201)
        elif method == "POST" and path == "/v1/jobs":
            self._answer(handler, server, self._job(self._queue(handler.headers["Idempotency-Key"])), 202)
        elif job and job[2]:
            self.set(job[1], "cancelled")
            self._answer(handler, server, self._job(job[1]))
        elif job:
            self._wait(job[1], handler, server)
        else:
            self._answer(handler, server, problem_document(404), 404)

    def set(self, job_id: str, state: str) -> None:
        with self._changed:
            if self.states[job_id] == "queued":
                self.states[job_id] = state
            self._changed.notify_all()

    def _queue(self, key: str) -> str:
        with self._changed:
            if key not in self.keys:
                self.keys[key] = f"job{len(self.keys)}"
                self.states[self.keys[key]] = "queued"
            self.most_at_once = max(self.most_at_once, list(self.states.values()).count("queued"))
            return self.keys[key]

    def _wait(self, job_id: str, handler: BaseHTTPRequestHandler, server: ScriptedServer) -> None:
        self.waited_for.release()
        if self.succeed_at_once:
            self.set(job_id, "succeeded")
        seconds = float((handler.headers["Prefer"] or "wait=0").removeprefix("wait="))
        with self._changed:
            self._changed.wait_for(lambda: self.states[job_id] != "queued" or server.closing.is_set(), timeout=seconds)
        self._answer(handler, server, self._job(job_id))

    def _job(self, job_id: str) -> dict[str, Any]:
        state = self.states[job_id]
        result = json.loads(plan_result(grasp(1)).model_dump_json()) if state == "succeeded" else None
        return job_document(state, id=job_id, result=result)

    def _answer(
        self, handler: BaseHTTPRequestHandler, server: ScriptedServer, document: Any, status: int = 200
    ) -> None:
        answers(document, status)(handler, server)


OBJECT = filled(ObjectInfo, created_at="2026-01-01T00:00:00Z")
