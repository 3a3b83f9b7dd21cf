"""The pages themselves: fixed files, read once, which take everything that changes from the API."""

import hashlib
from dataclasses import dataclass
from importlib.resources import files
from typing import Annotated

from fastapi import APIRouter, Header, Response

from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind

__all__ = ["router"]

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; frame-src 'self'; "
    "form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
_MEDIA_TYPES = {
    "css": "text/css; charset=utf-8",
    "html": "text/html; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
}
router = APIRouter(prefix="/review", include_in_schema=False)


@dataclass(frozen=True)
class _SiteFile:
    """A file of the pages, and the tag by which a browser knows that it has it already."""

    content: bytes
    media_type: str
    etag: str

    def answer(self, known: str | None, policy: str | None = None) -> Response:
        """The file, or only that it is still the same; with a content security policy if it is a page."""
        headers = {"ETag": self.etag, "Cache-Control": "no-cache"}
        if policy is not None:
            headers["Content-Security-Policy"] = policy
        if known == self.etag:
            return Response(status_code=304, headers=headers)
        return Response(self.content, headers=headers, media_type=self.media_type)


def _read_site() -> dict[str, _SiteFile]:
    site = {}
    for file in files("fingersplit_service.review").joinpath("site").iterdir():
        content, suffix = file.read_bytes(), file.name.rpartition(".")[2]
        etag = f'"{hashlib.sha256(content).hexdigest()[:20]}"'
        site[file.name] = _SiteFile(content, _MEDIA_TYPES[suffix], etag)
    return site


_SITE = _read_site()
Known = Annotated[str | None, Header(alias="If-None-Match")]


@router.get("")
async def list_page(known: Known = None) -> Response:
    """All runs."""
    return _page("list.html", known)


@router.get("/new")
async def new_page(known: Known = None) -> Response:
    """Upload a mesh and plan."""
    return _page("new.html", known)


@router.get("/runs/{_job_id}")
async def run_page(_job_id: str, known: Known = None) -> Response:
    """One run."""
    return _page("run.html", known)


@router.get("/compare")
async def compare_page(known: Known = None) -> Response:
    """Two runs."""
    return _page("compare.html", known)


@router.get("/login")
async def login_page(known: Known = None) -> Response:
    """Trade an API key for a session."""
    return _page("login.html", known)


@router.get("/site/{name}", responses=problem_answers(ProblemKind.NOT_FOUND))
async def site_file(name: str, known: Known = None) -> Response:
    """A script, the style sheet or the mark."""
    file = _SITE.get(name)
    if file is None or name.endswith(".html"):
        raise ProblemError(ProblemKind.NOT_FOUND, f"The pages have no file {name!r}.")
    return file.answer(known)


def _page(name: str, known: str | None) -> Response:
    return _SITE[name].answer(known, _POLICY)
