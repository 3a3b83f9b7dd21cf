"""The pages themselves: one frame and what stands in it, put together once; all that changes comes from the API."""

import hashlib
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from textwrap import indent
from typing import Annotated

from fastapi import APIRouter, Header, Request, Response
from fastapi.responses import RedirectResponse

from fingersplit_service.problems import ProblemError, ProblemKind, problem_answers

__all__ = ["root", "router", "unknown"]

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
_TITLES = {
    "list": "Runs",
    "new": "New run",
    "run": "Run",
    "compare": "Comparison",
    "sets": "Data sets",
    "set": "Data set",
    "batch": "Batch",
    "hands": "Hands",
    "hand": "Hand",
    "login": "Sign in",
    "missing": "Page not found",
}
_HERE = ' aria-current="page"'
router = APIRouter(prefix="/review", include_in_schema=False)
root = APIRouter(include_in_schema=False)
unknown = APIRouter(prefix="/review", include_in_schema=False)
"""Takes what no other route below /review takes, so it comes last."""


@root.get("/")
async def root_page() -> Response:
    """The pages stand below /review."""
    return RedirectResponse("/review", status_code=307)


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
    """The files that pages name, by their names."""
    found = files("fingersplit_service.review").joinpath("site").iterdir()
    kept = {file.name: file.read_bytes() for file in found if not file.name.endswith(".html")}
    return {name: _site_file(content, name.rpartition(".")[2]) for name, content in kept.items()}


def _read_pages() -> dict[str, _SiteFile]:
    """The pages, by the names of their scripts."""
    site = files("fingersplit_service.review").joinpath("site")
    frame, pages = Template(site.joinpath("frame.html").read_text()), {}
    for name, title in _TITLES.items():
        content = indent(site.joinpath(f"{name}.html").read_text().rstrip(), 6 * " ")
        here = {f"at_{place}": _HERE if name == place else "" for place in ("list", "new", "sets", "hands")}
        page = frame.substitute(here, title=title, name=name, content=content)
        pages[name] = _site_file(page.encode(), "html")
    return pages


def _site_file(content: bytes, suffix: str) -> _SiteFile:
    return _SiteFile(content, _MEDIA_TYPES[suffix], f'"{hashlib.sha256(content).hexdigest()[:20]}"')


_SITE, _PAGES = _read_site(), _read_pages()
Known = Annotated[str | None, Header(alias="If-None-Match")]


@router.get("")
async def list_page(known: Known = None) -> Response:
    """All runs."""
    return _page("list", known)


@router.get("/new")
async def new_page(known: Known = None) -> Response:
    """Upload a mesh and plan."""
    return _page("new", known)


@router.get("/runs/{_job_id}")
async def run_page(_job_id: str, known: Known = None) -> Response:
    """One run."""
    return _page("run", known)


@router.get("/datasets")
async def sets_page(known: Known = None) -> Response:
    """Data sets and batches."""
    return _page("sets", known)


@router.get("/datasets/{_dataset_id}")
async def set_page(_dataset_id: str, known: Known = None) -> Response:
    """One data set."""
    return _page("set", known)


@router.get("/batches/{_batch_id}")
async def batch_page(_batch_id: str, known: Known = None) -> Response:
    """One batch."""
    return _page("batch", known)


@router.get("/hands")
async def hands_page(known: Known = None) -> Response:
    """The hands, and the upload of another."""
    return _page("hands", known)


@router.get("/hands/{_name}")
async def hand_page(_name: str, known: Known = None) -> Response:
    """One hand."""
    return _page("hand", known)


@router.get("/compare")
async def compare_page(known: Known = None) -> Response:
    """Two runs."""
    return _page("compare", known)


@router.get("/login")
async def login_page(known: Known = None) -> Response:
    """Trade an API key for a session."""
    return _page("login", known)


@router.get("/site/{name}", responses=problem_answers(ProblemKind.NOT_FOUND))
async def site_file(name: str, known: Known = None) -> Response:
    """A script, the style sheet or the mark."""
    file = _SITE.get(name)
    if file is None:
        raise ProblemError(ProblemKind.NOT_FOUND, f"The pages have no file {name!r}.")
    return file.answer(known)


@unknown.get("/{path:path}")
async def missing_page(path: str, request: Request) -> Response:
    """A page for people, a problem document for programs; with a slash at the end, the page without it."""
    if request.url.path.endswith("/"):
        asked = f"?{request.url.query}" if request.url.query else ""
        return RedirectResponse(f"/review/{path}".rstrip("/") + asked, status_code=307)
    if "text/html" not in request.headers.get("Accept", ""):
        raise ProblemError(ProblemKind.NOT_FOUND, f"There is nothing at /review/{path}.")
    answer = _page("missing", None)
    answer.status_code = 404
    return answer


def _page(name: str, known: str | None) -> Response:
    return _PAGES[name].answer(known, _POLICY)
