"""Scenes from a depth camera: one image becomes a target object and what stands around it."""

import math
from contextlib import AsyncExitStack
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, File, Form, UploadFile

from fingersplit.numerals import read_floats
from fingersplit_client.schemas import ObjectOptions, ViewedScene
from fingersplit_service.dependencies import Files, Objects
from fingersplit_service.endpoints.forms import ExactForm
from fingersplit_service.endpoints.objects import object_options
from fingersplit_service.endpoints.uploads import PRINTABLE, staged, stem
from fingersplit_service.jobs.object_work import ViewUpload
from fingersplit_service.problems import ProblemError, ProblemKind, problem_answers
from fingersplit_service.security.access import Planner

__all__ = ["PATH", "router"]

PATH = "/v1/scenes/from-depth"
router = APIRouter(tags=["objects"])


@router.post(
    PATH,
    status_code=201,
    summary="Cut a depth image into an object and a scene",
    responses=problem_answers(ProblemKind.INVALID_REQUEST, ProblemKind.INVALID_MESH),
    dependencies=[Depends(ExactForm())],
)
async def scene_from_depth(
    objects: Objects,
    storage: Files,
    principal: Planner,
    file: Annotated[
        UploadFile,
        File(
            description="`.npz` with `depth` (h, w) and `intrinsics`, or an organised cloud `points` (h, w, 3), and "
            "perhaps `mask`, `depth_scale` and `world_from_camera` (4, 4); or a `.png` of 16 bits."
        ),
    ],
    described: Annotated[ObjectOptions, Depends(object_options)],
    mask: Annotated[UploadFile | None, File(description="`.png` whose pixels of the object are not 0.")] = None,
    intrinsics: Annotated[
        str | None, Form(description="fx,fy,cx,cy in pixels, without distortion.", max_length=200)
    ] = None,
    depth_scale: Annotated[
        float | None, Form(description="Metres of one unit of depth; 0.001 by default for whole numbers.", gt=0, lt=100)
    ] = None,
    camera_pose: Annotated[
        str | None,
        Form(
            description="world_from_camera as x,y,z,qw,qx,qy,qz; optical frame: x right, y down, z along the view.",
            max_length=400,
        ),
    ] = None,
    frame: Annotated[
        Literal["world", "camera"], Form(description="Frame of the scene and of the answers of its jobs.")
    ] = "world",
    support: Annotated[bool, Form(description="Whether to find the plane that the object stands on.")] = False,
    clearance: Annotated[float, Form(description="Of the hand from obstacles and support [m].", ge=0, le=0.05)] = 0.002,
    complete: Annotated[
        bool,
        Form(
            description="Whether the unseen side of the target is assumed where its support is known, and may carry "
            "contacts."
        ),
    ] = True,
    name: Annotated[str, Form(description="Name of the object for people.", max_length=200, pattern=PRINTABLE)] = "",
) -> ViewedScene:
    """The target becomes an object whose frame is the camera's; `scene` goes into jobs for it as it is.

    The obstacles are all that was measured within half a metre of the target, but for what lies in the support surface.
    """
    async with AsyncExitStack() as files:
        path = await files.enter_async_context(staged(storage, file))
        view = ViewUpload(
            path=path,
            mask=None if mask is None else await files.enter_async_context(staged(storage, mask)),
            intrinsics=_numbers("intrinsics", intrinsics, 4),
            depth_scale=depth_scale,
            camera_pose=_numbers("camera_pose", camera_pose, 7),
            frame=frame,
            support=support,
            clearance=clearance,
            complete=complete,
            options=described.model_dump(),
        )
        return await objects.add_view(principal.owner, name or stem(file), view)


def _numbers(field: str, text: str | None, count: int) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        numbers = tuple(read_floats(text.encode().split(b",")))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        detail = f"{field} is {text!r}; it must be {count} numbers with commas between them."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=f"/{field}")
    return numbers
