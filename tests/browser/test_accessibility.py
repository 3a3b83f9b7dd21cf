"""Every page against axe-core, in both sizes and both colour schemes: nothing serious may be wrong."""

from contextlib import suppress
from itertools import product

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import TimeoutError as NotIdleError

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_client import Client, JobCreate
from pages import LAPTOP, PHONE

SERIOUS = {"serious", "critical"}
FOREIGN = {"docs": {"nested-interactive", "color-contrast"}}
"""Faults that Swagger UI brings along: buttons within buttons, and its version badges in light grey."""


@pytest.fixture(scope="module")
def pages(service, runs, cornered, tmp_path_factory):
    """The address of every page by its name, each with something to show."""
    tin = tmp_path_factory.mktemp("meshes") / "tin.ply"
    PARAMETRIC_OBJECTS["cylinder"]().trimesh.export(tin)
    with Client(service) as client:
        tin = client.objects.upload(tin, unit="m", name="a tin to look at")
        batch = client.batches.create([JobCreate(object_id=tin.id, starts=2)])
        made = client.datasets.create([tin.id], name="tins", per_object=1, job={"starts": 4})
    return {
        "list": "/review",
        "new": "/review/new",
        "run": f"/review/runs/{runs[0]}",
        "scene": f"/review/runs/{cornered}",
        "compare": f"/review/compare?a={runs[0]}&b={runs[1]}",
        "hands": "/review/hands",
        "hand": "/review/hands/barrett",
        "sets": "/review/datasets",
        "set": f"/review/datasets/{made.id}",
        "batch": f"/review/batches/{batch.id}",
        "login": "/review/login",
        "docs": "/docs",
    }


def test_no_page_has_a_serious_fault(visit, pages):
    found = {}
    for name, path in pages.items():
        page = visit(path)
        with suppress(NotIdleError):  # what is not ended is asked for again and again
            page.wait_for_load_state("networkidle", timeout=20_000)
        page.wait_for_function("() => document.querySelector('h1, .opblock')?.textContent")
        for (device, size), scheme in product((("laptop", LAPTOP), ("phone", PHONE)), ("light", "dark")):
            page.set_viewport_size(size)
            page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
            page.evaluate("() => Promise.all(document.getAnimations().map((one) => one.finished.catch(() => {})))")
            assert page.evaluate("document.documentElement.scrollWidth") <= size["width"], (name, device)
            for fault in Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]:
                if fault["impact"] in SERIOUS and fault["id"] not in FOREIGN.get(name, ()):
                    nodes = [node["html"][:160] for node in fault["nodes"][:3]]
                    found[name, device, scheme, fault["id"]] = nodes
    assert found == {}
