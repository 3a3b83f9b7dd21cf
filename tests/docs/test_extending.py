"""docs/extending.md: every block is a new file in its place, and nothing else has to change."""

import importlib
import re
from pathlib import Path

import pytest

from fingersplit.contacts.metrics import available_metrics
from fingersplit.formats import available_formats, export_file
from fingersplit.parallel_grasps.sources import available_sources
from fingersplit.planning.planning import plan
from fingersplit.verification.protocols import available_protocols

PAGE = (Path(__file__).parents[2] / "docs" / "extending.md").read_text()
BLOCKS = dict(re.findall(r"```python\n# core/(fingersplit/\S+\.py)\n(.*?)```", PAGE, re.DOTALL))
REGISTRIES = (available_metrics, available_formats, available_protocols, available_sources)


@pytest.fixture
def with_new_files(tmp_path, monkeypatch):
    """All blocks of the page as files of their packages."""
    for path, text in BLOCKS.items():
        folder, _, name = path.rpartition("/")
        package = importlib.import_module(folder.replace("/", "."))
        place = tmp_path / folder
        place.mkdir(parents=True)
        (place / name).write_text(text)
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(place)])
    for registry in REGISTRIES:
        registry.cache_clear()
    yield
    monkeypatch.undo()
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
