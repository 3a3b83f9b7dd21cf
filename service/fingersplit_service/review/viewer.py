"""Viewers from this origin: three.js for the pages' own views, and rerun's, in the build that wrote the recordings."""

import asyncio
import sys
from importlib.resources import files

from fastapi import APIRouter, Request, Response
from fastapi.responses import FileResponse

from fingersplit.errors import ViewerError
from fingersplit.recording.three_assets import THREE_FILE, set_up_three
from fingersplit.recording.viewer_assets import VIEWER_FILES, viewer_folder, viewer_is_set_up
from fingersplit_service.problems import ProblemError, ProblemKind

__all__ = ["router"]

_POLICY = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; img-src 'self' blob:; "
    "connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
_MEDIA_TYPES = {"js": "text/javascript; charset=utf-8", "wasm": "application/wasm"}
_SET_UP = "from fingersplit.recording.viewer_assets import set_up_viewer; set_up_viewer()"
_setting_up = asyncio.Lock()
router = APIRouter(prefix="/review/viewer", include_in_schema=False)


@router.get("")
async def viewer_page() -> Response:
    """The viewer on the recording named in the address; made to stand in a frame of our own pages."""
    page = files("fingersplit_service.review").joinpath("site", "viewer.html").read_text()
    headers = {"Content-Security-Policy": _POLICY, "X-Frame-Options": "SAMEORIGIN", "Cache-Control": "no-cache"}
    return Response(page.replace("{version}", viewer_folder().name), headers=headers, media_type="text/html")


@router.get("/three.js")
async def three_file() -> Response:
    """three.js for the pages' own views, compressed; set up now if that was not done before."""
    try:
        folder = await asyncio.to_thread(set_up_three)
    except ViewerError as error:
        raise ProblemError(ProblemKind.NOT_FOUND, str(error)) from error
    headers = {"Content-Encoding": "gzip", "Cache-Control": "public, max-age=86400", "Vary": "Accept-Encoding"}
    return FileResponse(folder / f"{THREE_FILE}.gz", headers=headers, media_type=_MEDIA_TYPES["js"])


@router.get("/{version}/{name}")
async def viewer_file(request: Request, version: str, name: str) -> Response:
    """A file of the viewer, compressed; set up now if that was not done before."""
    if version != viewer_folder().name or name not in VIEWER_FILES:
        raise ProblemError(ProblemKind.NOT_FOUND, f"There is nothing at {request.url.path}.")
    async with _setting_up:
        if not viewer_is_set_up():
            await _set_up()
    headers = {
        "Content-Encoding": "gzip",
        "Cache-Control": "public, max-age=31536000, immutable",
        "Vary": "Accept-Encoding",
    }
    return FileResponse(
        viewer_folder() / f"{name}.gz", headers=headers, media_type=_MEDIA_TYPES[name.rpartition(".")[2]]
    )


async def _set_up() -> None:
    """In a process of its own: the package serves its viewer as long as the process lives."""
    process = await asyncio.create_subprocess_exec(sys.executable, "-c", _SET_UP)
    if await process.wait() != 0:
        detail = "The viewer cannot be set up; `fingersplit setup-viewer` on the service's machine says why."
        raise ProblemError(ProblemKind.INTERNAL, detail)
