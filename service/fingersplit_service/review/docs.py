"""The interactive description of the interface, light or dark as the reader's system is."""

from fastapi import APIRouter, Request
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse

__all__ = ["router"]

_STATIC = "/static-offline-docs"
_HEAD = '<script src="/review/site/docs.js"></script><link rel="stylesheet" href="/review/site/docs.css" />'
_BACK = '<nav class="back" aria-label="Main"><a href="/review">Fingersplit, pages for people</a></nav>'
router = APIRouter(include_in_schema=False)


@router.get("/docs")
async def docs_page(request: Request) -> HTMLResponse:
    """Swagger UI with files of this service alone, and what chooses its dark colours."""
    page = get_swagger_ui_html(
        openapi_url=request.app.openapi_url,
        title=f"{request.app.title} · API",
        swagger_js_url=f"{_STATIC}/swagger-ui-bundle.js",
        swagger_css_url=f"{_STATIC}/swagger-ui.css",
        swagger_favicon_url="/review/site/mark.svg",
    )
    text = bytes(page.body).decode().replace("<html>", '<html lang="en">', 1)
    return HTMLResponse(text.replace("</head>", f"{_HEAD}</head>", 1).replace("<body>", f"<body>{_BACK}", 1))
