"""Results as robot programs want them: the documents of the wire with matrices, frames, pictures and exports.

`PlanResult`, `Grasp`, `Pregrasp` and `Job` have every field of the wire type they extend, and are written like it. What
needs the service again (pictures, exports) blocks where the result came from a `Client`, and is awaited where it came
from an `AsyncClient`.
"""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Generic, Self

from pydantic import PrivateAttr, ValidationError

from fingersplit_client import _notebook, schemas
from fingersplit_client._exchange import quoted
from fingersplit_client._flow import Flow
from fingersplit_client.errors import FingersplitClientError, invalid
from fingersplit_client.grasps import Grasp, Link, LinkedDocument
from fingersplit_client.modes import Blocking, Mode, operation
from fingersplit_client.schemas.field_faults import fault_in_words
from fingersplit_client.transforms import Transform, TransformLike, dot, norm

__all__ = ["Job", "PlanResult"]


class PlanResult(schemas.PlanResult, LinkedDocument[Mode], Generic[Mode]):
    """The ranked grasps of a job."""

    grasps: list[Grasp[Mode]]  # type: ignore[assignment]  # a list of the same documents, which can do more
    _pictures: dict[int, bytes] = PrivateAttr(default_factory=dict)

    @property
    def best(self) -> Grasp[Mode]:
        """The first feasible grasp that held in simulation; where none was simulated, the first feasible one.

        Raises:
            FingersplitClientError: There is none; the message is the planner's.
        """
        feasible = self.select()
        verified = [grasp for grasp in feasible if grasp.held is not None]
        best = next((grasp for grasp in verified if grasp.held), None)
        if best is None and feasible and not verified:
            best = feasible[0]
        if best is None:
            what = "No grasp held in simulation" if verified else "There is no feasible grasp"
            raise FingersplitClientError(f"{what}. {self.summary.message}")
        return best

    def select(
        self,
        *,
        feasible: bool = True,
        verified: bool = False,
        approach: Sequence[float] | None = None,
        within: float = math.pi / 4,
        margin: float | None = None,
        clearance: float | None = None,
        frame_from_object: TransformLike | None = None,
    ) -> list[Grasp[Mode]]:
        """The grasps that fulfil all that is asked for, best first.

        Args:
            feasible: Only feasible ones.
            verified: Only those that held in simulation.
            approach: Only those whose approach points about this way; those without a free way in are left out.
            within: Largest angle between the two [rad].
            margin: Least holding margin [N].
            clearance: Least distance to what stands around in the scene [m].
            frame_from_object: Pose of the object in the frame of ``approach``; by default that is the object frame.

        Raises:
            InvalidRequestError: The result does not say what is asked for.
        """
        chosen = [grasp for grasp in self.grasps if grasp.feasible or not feasible]
        if verified:
            chosen = [grasp for grasp in chosen if grasp.held]
        if margin is not None:
            chosen = [one for one in chosen if _margin(one) >= margin]
        if clearance is not None:
            chosen = [grasp for grasp in chosen if _clearance(grasp) >= clearance]
        if approach is not None:
            pose = Transform() if frame_from_object is None else Transform.of(frame_from_object)
            wanted = pose.inverse().rotate(approach)
            chosen = [one for one in chosen if one.approach and _angle(one.approach, wanted) <= within]
        return chosen

    @operation
    def picture(self, rank: int | None = None) -> Flow[bytes]:
        """PNG of one grasp, by default the best: hand and object at the start and at the end, and the quality curve."""
        shown = self.best.rank if rank is None else rank
        if shown not in self._pictures:
            response = yield from self._exchange("GET", f"{self._job_path}/grasps/{shown}/picture.png")
            self._pictures[shown] = bytes(response.content)
        return self._pictures[shown]

    @operation
    def export(self, format_name: str) -> Flow[bytes]:
        """All feasible grasps as a file of another tool, such as ``"moveit"`` or ``"isaac_grasp"``, object frame."""
        response = yield from self._exchange("GET", f"{self._job_path}/export/{quoted(format_name)}")
        return bytes(response.content)

    def save(self, path: "os.PathLike[str] | str") -> None:
        """Write the result document as JSON; ``fingersplit verify``, ``export`` and `load` read it."""
        staged = Path(f"{os.fspath(path)}.part")
        staged.write_text(self.model_dump_json(indent=2) + "\n", encoding="utf-8")
        staged.replace(path)  # a file that is there is whole

    @classmethod
    def load(cls, path: "os.PathLike[str] | str", client: Any = None, job_id: str | None = None) -> Self:
        """A result that was saved, or that ``fingersplit plan --json`` wrote.

        Args:
            path: The file.
            client: Whom to ask for pictures and exports.
            job_id: Id of the job that it came from, needed for these; it is not in the file.

        Raises:
            FingersplitClientError: The file holds no result of this version.
            OSError: It cannot be read.
        """
        try:
            result = cls.model_validate_json(Path(path).read_bytes())
        except ValidationError as error:
            raise FingersplitClientError(
                f"{os.fspath(path)} holds no result of this version: {_first(error)}"
            ) from error
        return result.linked(Link(None if client is None else client._mode(), job_id))

    def linked(self, link: Link) -> Self:
        """Tell the result and its grasps where they came from."""
        self._link = link
        for grasp in self.grasps:
            grasp._link = link
        return self

    def __repr__(self) -> str:
        held = "" if self.summary.verification is None else f", {self.summary.verification.held} held in simulation"
        feasible = f"{self.summary.feasible} of {self.summary.started} starts feasible"
        job = "" if self.job_id is None else f", job {self.job_id}"
        return f"<PlanResult {self.hand} on {self.object.name}: {len(self.grasps)} grasps, {feasible}{held}{job}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        return _notebook.result_html(self, self._shown_picture())

    def _shown_picture(self) -> bytes | None:
        """The picture for a notebook: one that is there, else one that can be had without waiting elsewhere."""
        if not self._pictures and isinstance(self._link.mode, Blocking):
            try:
                Blocking.run(self._link.mode, PlanResult.picture.flow(self))
            except FingersplitClientError:
                return None
        return next(iter(self._pictures.values()), None)


class Job(schemas.Job, LinkedDocument[Mode], Generic[Mode]):
    """Where a job stands, what was asked for, and its result once it has succeeded."""

    result: PlanResult[Mode] | None

    @property
    def ended(self) -> bool:
        """Whether it has succeeded, failed or was cancelled."""
        return self.state in ("succeeded", "failed", "cancelled")

    def __repr__(self) -> str:
        return f"<Job {self.id}: {self.state}, {self.hand} on {self.object_name}>"

    __str__ = __repr__


def _margin(grasp: schemas.Grasp) -> float:
    return -math.inf if grasp.metrics.holding_margin is None else grasp.metrics.holding_margin


def _clearance(grasp: schemas.Grasp) -> float:
    """Distance to what stands around, infinite where nothing is near [m]."""
    if grasp.world is None:
        raise invalid("It was planned without a scene, so there is no clearance; leave it out, or plan with a scene.")
    return math.inf if grasp.clearance is None else grasp.clearance.distance


def _angle(a: Sequence[float], b: Sequence[float]) -> float:
    length = norm(a) * norm(b)
    if length == 0:
        raise invalid("A direction of approach must not be zero.")
    return math.acos(max(-1.0, min(1.0, dot(a, b) / length)))


def _first(error: ValidationError) -> str:
    first = error.errors()[0]
    return f"{'.'.join(map(str, first['loc'])) or 'the document'}: {fault_in_words(first, 'a JSON object')}"
