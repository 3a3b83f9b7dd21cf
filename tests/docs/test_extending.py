"""docs/extending.md: every block is a new file in its place, and nothing else has to change."""

import importlib
import re
import sys
from pathlib import Path

import httpx2
import pytest

from fingersplit.contacts.metrics import available_metrics
from fingersplit.formats import available_formats, export_file
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.parallel_grasps.sources import available_sources
from fingersplit.planning.planning import plan
from fingersplit.verification.protocols import available_protocols
from fingersplit_client import AsyncClient
from fingersplit_service.app import create_app
from fingersplit_service.settings import ServiceSettings

sys.path.insert(0, str(Path(__file__).parent))  # worker processes import it by name

import extended_workers

PAGE = (Path(__file__).parents[2] / "docs" / "extending.md").read_text()
BLOCKS = dict(re.findall(r"```python\n# core/(fingersplit/\S+\.py)\n(.*?)```", PAGE, re.DOTALL))
PATIENCE = 600
"""How long a job may take where kernels are compiled first and other processes take most of the machine [s]."""
REGISTRIES = (available_metrics, available_formats, available_protocols, available_sources)


@pytest.fixture
def anyio_backend():
    return "asyncio"


@pytest.fixture
def new_files(tmp_path):
    """A folder with all blocks of the page, each where its package has it."""
    for path, text in BLOCKS.items():
        (tmp_path / path).parent.mkdir(parents=True)
        (tmp_path / path).write_text(text)
    return tmp_path


@pytest.fixture
def with_new_files(new_files, monkeypatch):
    """All blocks of the page as files of their packages."""
    for path in BLOCKS:
        folder = path.rpartition("/")[0]
        package = importlib.import_module(folder.replace("/", "."))
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(new_files / folder)])
    for registry in REGISTRIES:
        registry.cache_clear()
    yield
    monkeypatch.undo()
    for path in BLOCKS:
        sys.modules.pop(path.removesuffix(".py").replace("/", "."), None)  # else the next file of this name is not read
    for registry in REGISTRIES:
        registry.cache_clear()


def test_the_page_has_a_block_for_every_kind():
    assert len(BLOCKS) == len(REGISTRIES)


def test_a_new_file_is_all_it_takes(with_new_files, prepared, barrett):
    result = plan(prepared("box"), barrett, source="topmost", starts=8, seed=1, top_k=2)
    best = result.to_dict()["grasps"][0]
    assert 0.0 < best["metrics"]["spread"] < 0.2
    file = export_file(result, "palm_list")
    assert (file.suffix, file.media_type) == (".json", "application/json")
    assert b'"wxyz"' in file.content
    assert available_protocols()["tilt"].to_document()["gravity"] == 9.81


def test_without_the_files_they_are_unknown():
    assert {"spread", "palm_list", "tilt", "topmost"}.isdisjoint(
        {name for registry in REGISTRIES for name in registry()}
    )


@pytest.mark.anyio
async def test_new_files_are_known_over_http(new_files, tmp_path_factory, monkeypatch):
    """The service and its client list and take what the workers' folders hold; nothing of either was changed."""
    monkeypatch.setenv(extended_workers.ADDED, str(new_files))
    settings = ServiceSettings(
        data_dir=tmp_path_factory.mktemp("data"), workers=1, spare_workers=0, stop_grace_s=0, verify_first=False
    )
    app = create_app(settings, extended_workers.FUNCTIONS)
    async with (
        app.router.lifespan_context(app),
        AsyncClient("http://localhost", transport=httpx2.ASGITransport(app)) as client,
    ):
        await client.ready(timeout=PATIENCE)
        http = httpx2.AsyncClient(transport=httpx2.ASGITransport(app), base_url="http://localhost")
        listed = {
            kind: {entry["name"]: entry for entry in (await http.get(f"/v1/{kind}")).json()}
            for kind in ("metrics", "formats", "protocols", "sources")
        }
        assert {"spread", "palm_list", "tilt", "topmost"} <= {name for names in listed.values() for name in names}
        assert listed["protocols"]["tilt"]["numbers"]["gravity"] == 9.81
        box = PARAMETRIC_OBJECTS["box"]()
        asked = {"source": "topmost", "starts": 8, "seed": 1, "top_k": 1, "verified": 1, "protocol": "tilt"}
        result = await client.plan((box.vertices, box.faces), timeout=PATIENCE, **asked)
        (best,) = result.grasps
        assert best.verification.protocol == "tilt"
        assert best.metrics.model_dump()["spread"] < 0.2
        assert b'"wxyz"' in await result.export("palm_list")
