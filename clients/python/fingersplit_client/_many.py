"""Plans for many files: some at a time, saved as they end, taken up again where they were."""

import hashlib
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic
from uuid import uuid4

from fingersplit_client import _waiting
from fingersplit_client._exchange import Deadline
from fingersplit_client._flow import Abandon, Begin, Emit, Flow, NextEnded, Stream, Work
from fingersplit_client._planning import KnownObjects, PlanRequest, plan
from fingersplit_client._progress import progress_bar
from fingersplit_client.errors import (
    AuthenticationError,
    FingersplitClientError,
    JobFailed,
    RequestTimeout,
    ServiceUnreachable,
    invalid,
)
from fingersplit_client.mesh_files import MeshFile, read_mesh
from fingersplit_client.modes import Mode
from fingersplit_client.resources.objects import Objects
from fingersplit_client.results import PlanResult

__all__ = ["Planned", "plan_many"]

_RUN_FILE = ".fingersplit-run"
"""Holds an id; with it a killed program finds the jobs that it had queued."""


@dataclass(frozen=True)
class Planned(Generic[Mode]):
    """What became of one of many files.

    Attributes:
        path: The file.
        result: Its grasps; None where there is an error.
        error: Why there are none: the service's or client's error, or that of reading the file.
        saved: Where the result was saved; None where no folder was given.
        resumed: Whether it was saved by an earlier call.
    """

    path: Path
    result: PlanResult[Mode] | None = None
    error: FingersplitClientError | OSError | None = None
    saved: Path | None = None
    resumed: bool = False


def plan_many(
    objects: Objects[Mode],
    known: KnownObjects,
    meshes: "Iterable[os.PathLike[str] | str]",
    asked: PlanRequest,
    *,
    folder: "os.PathLike[str] | str | None",
    at_once: int,
    progress: bool | None,
    timeout: float,
    cancel: bool,
) -> Stream[Planned[Any]]:
    """Emit what became of each file; see `Client.plan_many`."""
    if at_once < 1:
        raise invalid(f"at_once is {at_once}; it must be 1 or more.")
    paths = [Path(mesh) for mesh in meshes]
    many = _Many(objects, known, asked, None if folder is None else Path(folder), timeout, cancel)
    yield Work(many.prepare)
    with progress_bar(len(paths), progress) as advance:
        try:
            yield Begin(many.flows(paths), at_once)
            while (planned := (yield NextEnded())) is not None:
                advance(planned.path.name)
                yield Emit(planned)
        except BaseException:
            yield Abandon()
            if cancel:
                for job_id in list(many.running):
                    yield from _waiting.cancel_quietly(objects, job_id)
            raise


class _Many:
    """The work on many files."""

    def __init__(
        self,
        objects: Objects[Any],
        known: KnownObjects,
        asked: PlanRequest,
        folder: Path | None,
        timeout: float,
        cancel: bool,
    ) -> None:
        self._objects, self._known, self._asked = objects, known, asked
        self._folder, self._timeout, self._cancel = folder, timeout, cancel
        self._run = uuid4().hex
        self.running: set[str] = set()

    def prepare(self) -> None:
        """Make the folder, or see who worked in it before."""
        if self._folder is not None:
            self._folder.mkdir(parents=True, exist_ok=True)
            named = self._folder / _RUN_FILE
            if not named.exists():
                named.write_text(self._run)
            self._run = named.read_text().strip()

    def flows(self, paths: Iterable[Path]) -> Iterator[Flow[Planned[Any]]]:
        """What is to be done for each file."""
        return (self._one(path) for path in paths)

    def _one(self, path: Path) -> Flow[Planned[Any]]:
        try:
            file: MeshFile = yield Work(partial(read_mesh, path, self._asked.file_type))
            digest = yield Work(partial(self._digest, file))
            saved = None if self._folder is None else self._folder / f"{file.stem}-{digest[:12]}.json"
            if saved is not None and saved.exists():
                earlier = yield Work(partial(self._load, saved))
                if earlier is not None:
                    return Planned(path, earlier, None, saved, resumed=True)
            result = yield from self._plan(file, f"{self._run}-{digest}")
            if saved is not None:
                yield Work(partial(result.save, saved))
        except (FingersplitClientError, OSError) as error:
            gone = isinstance(error, ServiceUnreachable) and not isinstance(error, RequestTimeout)
            if gone or isinstance(error, AuthenticationError):  # so would all others fail
                raise
            return Planned(path, error=error)
        return Planned(path, result, None, saved)

    def _plan(self, file: MeshFile, key: str) -> Flow[PlanResult[Any]]:
        try:
            return (yield from self._attempt(file, key if self._folder is not None else None))
        except JobFailed as error:
            if error.job.state != "cancelled" or self._folder is None:
                raise
        return (yield from self._attempt(file, None))  # the key found what an earlier run had cancelled

    def _attempt(self, file: MeshFile, key: str | None) -> Flow[PlanResult[Any]]:
        mine: list[str] = []

        def begun(job_id: str) -> None:
            mine.append(job_id)
            self.running.add(job_id)

        try:
            return (
                yield from plan(
                    self._objects,
                    self._known,
                    file,
                    self._asked,
                    Deadline(self._timeout),
                    cancel=self._cancel,
                    on_job=begun,
                    key=key,
                )
            )
        finally:
            self.running.difference_update(mine)

    def _digest(self, file: MeshFile) -> str:
        """Stands for a file's content and all options."""
        parts = (file.sha256, self._asked.lookup.model_dump_json(), self._asked.request.model_dump_json())
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()

    def _load(self, saved: Path) -> PlanResult[Any] | None:
        """A result of an earlier call; None where the file is none."""
        try:
            result: PlanResult[Any] = PlanResult.load(saved)
        except FingersplitClientError:
            return None
        return result
