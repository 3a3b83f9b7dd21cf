"""A real service with the real planner, and pages in a real Chromium that may not ask for anything elsewhere."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, ViewportSize, sync_playwright

from chromium import ensure_chromium
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_client import Client, JobCreate, scenes
from pages import LAPTOP
from serving import serving

REPOSITORY = Path(__file__).parents[2]
SCREENSHOTS = REPOSITORY / "build" / "browser"
FLAGS = ["--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a service that these tests share."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("FINGERSPLIT_")}
    with serving(tmp_path_factory.mktemp("browser"), "--workers", 1, environment=environment) as url:
        yield url


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser, not kept for longer: while it is there, no other test of the process can run an event loop."""
    program = ensure_chromium()
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture
def visit(browser: Browser, service: str) -> Iterator[Callable[..., Page]]:
    """Open a page of the service; at the end, nothing may have gone wrong in it, and nothing elsewhere been asked."""
    with ExitStack() as stack:
        faults: list[str] = []
        own = urlsplit(service).netloc

        def note(said: ConsoleMessage, tolerates: str | None) -> None:
            if said.type == "error" and (tolerates is None or tolerates not in said.text):
                faults.append(f"console: {said.text}")

        def open_page(
            path: str, *, size: ViewportSize = LAPTOP, scheme: str = "light", tolerates: str | None = None
        ) -> Page:
            context = browser.new_context(viewport=size, color_scheme=scheme, base_url=service)
            stack.callback(context.close)
            page = context.new_page()
            page.set_default_timeout(60_000)
            page.on("console", lambda said: note(said, tolerates))
            page.on("pageerror", lambda error: faults.append(f"error: {error}"))
            page.on("request", lambda asked: _elsewhere(asked.url, own) and faults.append(f"request: {asked.url}"))
            page.goto(path)
            return page

        yield open_page
        assert faults == []


def _elsewhere(url: str, own: str) -> bool:
    """Whether an address is not the service's; blobs and data are made by the page itself."""
    parts = urlsplit(url)
    return parts.scheme not in ("blob", "data") and parts.netloc != own


@pytest.fixture
def keep(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Keep a screenshot of a page below build/browser."""

    def shoot(page: Page, name: str, *, full: bool = True) -> None:
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=SCREENSHOTS / f"{name}.png", full_page=full)

    return shoot


@pytest.fixture(scope="session")
def runs(service: str, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """Ids of two finished runs of the same can, with different settings; no other object is called so."""
    can = tmp_path_factory.mktemp("meshes") / "can.ply"
    PARAMETRIC_OBJECTS["cylinder"]().trimesh.export(can)
    with Client(service, timeout=120) as client:
        uploaded = client.objects.upload(can, unit="m", name="a can")
        jobs = [
            client.jobs.create(JobCreate(object_id=uploaded.id, starts=starts, seed=1, planner={"friction": friction}))
            for starts, friction in ((12, 0.6), (24, 0.8))
        ]
        return tuple(client.jobs.wait(job).id for job in jobs)


@pytest.fixture(scope="session")
def cornered(service: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Id of a run on a table, beside a wall, whose first grasps were picked in simulation until one was lifted."""
    box = tmp_path_factory.mktemp("meshes") / "box.ply"
    PARAMETRIC_OBJECTS["box"]().trimesh.export(box)
    around = scenes.scene(scenes.box("wall", (0.4, 0.02, 0.3), (0.0, 0.09, 0.15)), supports=[scenes.table()])
    with Client(service, timeout=120) as client:
        uploaded = client.objects.upload(box, unit="m", name="a crate in a corner")
        asked = JobCreate(object_id=uploaded.id, starts=16, seed=1, scene=around, verified=1, protocol="pick")
        return client.jobs.wait(client.jobs.create(asked)).id
