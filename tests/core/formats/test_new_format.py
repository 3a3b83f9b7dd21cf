"""A format is one file: put into the folder, it is listed, read, written and named in messages."""

import numpy as np
import pytest

from fingersplit import formats
from fingersplit.errors import FormatError
from fingersplit.formats import available_formats, export_file, grasp_at, import_parallel_grasps, read_hand_grasps
from fingersplit.formats.registry import available_formats as registry
from fingersplit.planning.planning import plan

PAIRS = '''"""Contacts as six numbers a line of JSON, and the palm and joints of a hand."""

import numpy as np

from fingersplit.formats.fields import numbers
from fingersplit.formats.file_format import FileFormat
from fingersplit.formats.hand_grasps import HandGrasp, HandGrasps
from fingersplit.grasp import HandPose
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps

__all__ = ["PAIRS"]


def _read_parallel(content, request):
    rows = numbers(content["pairs"], "pairs", (None, 6)).reshape(-1, 2, 3)
    return ParallelGrasps(request.scale * rows, np.tile([0.0, 0.0, -1.0], (len(rows), 1)))


def _read_hand(content, hand):
    hands = [
        HandGrasp(str(i), HandPose(np.array(one["pose"]), np.array(one["joints"])))
        for i, one in enumerate(content["hands"])
    ]
    return HandGrasps(hand, 1.0, tuple(hands))


def _write(export):
    hands = [{"pose": g.pose.object_from_palm.tolist(), "joints": g.pose.joints.tolist()} for g in export.grasps]
    return {"pairs": [[0, 0, 0, 1, 0, 0]], "hands": hands, "fingersplit": export.origin}


PAIRS = FileFormat(
    "pairs",
    "Pairs JSON",
    "json",
    lambda content: isinstance(content, dict) and "pairs" in content,
    read_parallel=_read_parallel,
    read_hand=_read_hand,
    write=_write,
)
'''


@pytest.fixture
def with_pairs(tmp_path, monkeypatch):
    (tmp_path / "pairs.py").write_text(PAIRS)
    monkeypatch.setattr(formats, "__path__", [*formats.__path__, str(tmp_path)])
    registry.cache_clear()
    yield
    monkeypatch.undo()
    registry.cache_clear()


def test_it_is_listed_and_named(with_pairs, tmp_path, prepared):
    assert available_formats()["pairs"].to_document() == {
        "name": "pairs",
        "title": "Pairs JSON",
        "suffix": ".json",
        "media_type": "application/json",
        "reads_parallel_grasps": True,
        "reads_hand_grasps": True,
        "writes": True,
        "one_grasp": False,
    }
    (tmp_path / "other.xml").write_text("<a/>")
    with pytest.raises(FormatError, match="Pairs JSON"):
        import_parallel_grasps(tmp_path / "other.xml", prepared("box"))


def test_it_is_read(with_pairs, tmp_path, prepared):
    (tmp_path / "two.json").write_text('{"pairs": [[25, 0, 0, -25, 0, 0], [0, 35, 0, 0, -35, 0]]}')
    imported = import_parallel_grasps(tmp_path / "two.json", prepared("box"), scale=1e-3)
    assert (imported.format, len(imported.grasps)) == ("pairs", 2)
    np.testing.assert_allclose(imported.grasps.contacts[0], [[0.025, 0, 0], [-0.025, 0, 0]])


def test_it_is_written_and_read_back(with_pairs, tmp_path, prepared, barrett):
    found = plan(prepared("box"), barrett, starts=8, seed=1, top_k=3)
    file = export_file(found, "pairs")
    assert (file.suffix, file.media_type) == (".json", "application/json")
    (tmp_path / "hands.json").write_bytes(file.content)
    read = read_hand_grasps(tmp_path / "hands.json", "barrett")
    again = grasp_at(prepared("box"), barrett, read.grasps[0].pose)
    np.testing.assert_allclose(again.contacts, found.grasps[0].for_hand(barrett).contacts, atol=1e-5)
