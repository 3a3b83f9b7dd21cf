"""The hands that can be planned for: those that ship, and uploaded ones."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, File, Form, Path, Response, UploadFile
from fastapi.responses import FileResponse

from fingersplit_client.schemas import HandDescriptionCreate, HandDetail, HandInfo
from fingersplit_service.dependencies import Files, Hands
from fingersplit_service.endpoints.documents import ID_PATTERN
from fingersplit_service.endpoints.forms import ExactForm
from fingersplit_service.endpoints.uploads import PRINTABLE, staged, stem
from fingersplit_service.jobs.hand_work import HandUpload
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Planner, Reader

__all__ = ["PATH", "router"]

PATH = "/v1/hands"
_HAND = PATH + "/{hand_id}"
_PROBLEMS = problem_answers(
    ProblemKind.NOT_FOUND,
    ProblemKind.INVALID_REQUEST,
    ProblemKind.NOT_READY,
    ProblemKind.GONE,
    ProblemKind.WORKER_FAILED,
)
_KEPT_PROBLEMS = _PROBLEMS | problem_answers(ProblemKind.LIMIT_REACHED)
_KNOWN_ALREADY: dict[int | str, dict[str, Any]] = {
    200: {"model": HandDetail, "description": "The same files with the same description are here already."}
}
HandId = Annotated[
    str, Path(description="Name of a hand; of an uploaded one its id.", max_length=64, pattern=ID_PATTERN)
]
Words = Annotated[str, Form(max_length=2000, pattern=PRINTABLE)]
router = APIRouter(tags=["hands"])


class _PngResponse(FileResponse):
    """A PNG file."""

    media_type = "image/png"


@router.get(PATH, summary="List the hands", responses=problem_answers(ProblemKind.NOT_READY))
async def list_hands(hands: Hands, principal: Reader) -> list[HandInfo]:
    """Every hand with its fingers, joints and limits: those that ship, then the uploaded ones, newest first."""
    return await hands.all(principal.owner)


@router.post(
    PATH,
    status_code=201,
    summary="Upload a hand",
    dependencies=[Depends(ExactForm())],
    responses=_KNOWN_ALREADY | _KEPT_PROBLEMS,
)
async def create_hand(
    hands: Hands,
    storage: Files,
    principal: Planner,
    response: Response,
    file: Annotated[UploadFile, File(description="Zip of the model, its meshes, and hand.toml if there is one.")],
    model: Annotated[Words, Form(description="Model file in the zip, where there are several and no hand.toml.")] = "",
    palm: Annotated[Words, Form(description="Body of the palm, where a draft finds the wrong one.")] = "",
    fingers: Annotated[
        Words, Form(description="Last bodies of the fingers, separated by commas, where a draft finds others.")
    ] = "",
) -> HandDetail:
    """Check and compile a hand and keep it; its `name` can then be the `hand` of a job.

    Without a `hand.toml` the description is drafted from the model by moving it, and marked as such; look at the
    report and correct it. A worker process with limits of time and memory reads the archive.
    """
    tips = tuple(name.strip() for name in fingers.split(",") if name.strip())
    async with staged(storage, file) as path:
        upload = HandUpload(path, stem(file) or "hand", model or None, palm or None, tips)
        info, fresh = await hands.add(principal.owner, upload)
    return _made(response, info, fresh)


@router.get(_HAND, summary="Get a hand", responses=_PROBLEMS)
async def get_hand(hands: Hands, principal: Reader, hand_id: HandId) -> HandDetail:
    """A hand with its description and the report of its check."""
    return await hands.get(principal.owner, hand_id)


@router.post(
    _HAND + "/descriptions", status_code=201, summary="Correct a hand", responses=_KNOWN_ALREADY | _KEPT_PROBLEMS
)
async def correct_hand(
    hands: Hands, principal: Planner, response: Response, hand_id: HandId, corrected: HandDescriptionCreate
) -> HandDetail:
    """Give the files of an uploaded hand another description. That is another hand: results stay what they are."""
    return _made(response, *await hands.correct(principal.owner, hand_id, corrected.description))


@router.post(_HAND + "/trial", summary="Try a hand", responses=_PROBLEMS)
async def try_hand(hands: Hands, principal: Planner, hand_id: HandId) -> HandDetail:
    """Plan for a sphere, a box and a cylinder in three sizes; what came of it stands in `trial`."""
    return await hands.try_out(principal.owner, hand_id)


@router.get(_HAND + "/picture.png", response_class=_PngResponse, summary="See a hand", responses=_PROBLEMS)
async def get_hand_picture(hands: Hands, principal: Reader, hand_id: HandId) -> _PngResponse:
    """The hand with all drivers half-way, and at the preshapes of its first grip."""
    path = await hands.view(principal.owner, hand_id, "picture.png")
    return _PngResponse(path, headers=_KEPT, media_type=_PngResponse.media_type)


@router.get(_HAND + "/scene", response_model=dict[str, Any], summary="Get a hand to draw", responses=_PROBLEMS)
async def get_hand_scene(hands: Hands, principal: Reader, hand_id: HandId) -> FileResponse:
    """Links, joints, couplings and meshes of a hand, as the pages draw and move it."""
    path = await hands.view(principal.owner, hand_id, "scene.json.gz")
    headers = _KEPT | {"Content-Encoding": "gzip"}
    return FileResponse(path, headers=headers, media_type="application/json")


@router.delete(
    _HAND, status_code=204, summary="Delete a hand", responses=_PROBLEMS | problem_answers(ProblemKind.IN_USE)
)
async def delete_hand(hands: Hands, principal: Planner, hand_id: HandId) -> Response:
    """Delete an uploaded hand. Ended jobs keep their results; their pictures cannot be redrawn."""
    await hands.delete(principal.owner, hand_id)
    return Response(status_code=204)


_KEPT = {"Cache-Control": "private, max-age=86400"}


def _made(response: Response, hand: HandDetail, fresh: bool) -> HandDetail:
    response.status_code = 201 if fresh else 200
    response.headers["Location"] = f"{PATH}/{hand.name}"
    return hand
