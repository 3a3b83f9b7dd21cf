"""`load_object`: from a file to a prepared object, with what was said of it."""

import numpy as np
import pytest
import trimesh

from fingersplit.errors import ObjectFileError
from fingersplit.objects.loading import load_object
from fingersplit.objects.model import ObjectModel, object_id
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.source import ObjectSource


@pytest.fixture
def box_file(tmp_path):
    path = tmp_path / "brick.obj"
    trimesh.creation.box([40.0, 60.0, 100.0]).export(path)
    return path


@pytest.mark.parametrize(
    ("unit", "scale", "length"), [("mm", 1.0, 0.1), ("m", 0.001, 0.1), ("cm", 0.25, 0.25), ("in", 0.01, 0.0254)]
)
def test_unit_and_scale_multiply(box_file, unit, scale, length):
    model = load_object(box_file, unit=unit, scale=scale)
    assert model.mesh.extents == pytest.approx(np.array([0.4, 0.6, 1.0]) * length)
    document = model.to_document()
    assert document["source"] == {"unit": unit, "scale": scale, "viewpoint": None, "support": None}
    assert (document["report"]["unit"], document["report"]["scale"]) == (unit, scale)
    assert (document["name"], model.source) == ("brick", ObjectSource(unit, scale))


@pytest.mark.parametrize("scale", [0, -1.0, float("nan"), float("inf"), "2", True])
def test_scale_must_be_a_positive_number(box_file, scale):
    with pytest.raises(ObjectFileError, match=r"scale is .*; it must be a positive number") as refusal:
        load_object(box_file, scale=scale)
    assert refusal.value.code == "invalid_scale"


def test_too_large_an_object_is_told_of_unit_and_scale(box_file):
    with pytest.raises(ObjectFileError, match=r"10 m .* unit 'm' and scale 0\.1; .* may be 'mm' \(0\.01 m\) or 'cm'"):
        load_object(box_file, scale=0.1)


def test_viewpoint_of_a_cloud_is_in_the_files_unit(tmp_path):
    rng = np.random.default_rng(1)
    points = rng.normal(size=(3000, 3))
    points *= 30 / np.linalg.norm(points, axis=1, keepdims=True)
    path = tmp_path / "ball.npz"
    np.savez(path, points=points[points[:, 2] > 0])
    model = load_object(path, unit="mm", viewpoint=(0, 0, 600), name="half a ball")
    assert model.name == "half a ball"
    assert model.to_document()["source"] == {
        "unit": "mm",
        "scale": 1.0,
        "viewpoint": [0.0, 0.0, 600.0],
        "support": None,
    }
    assert model.to_document()["report"]["viewpoint"]
    assert model.seen < 0.9


def test_id_stands_for_shape_and_options():
    mesh = box()

    def prepared(**options: float) -> ObjectModel:
        return prepare_object(mesh, options=ObjectOptions(**options))

    assert prepared().id == mesh.content_hash == object_id(mesh.content_hash, ObjectOptions())
    ids = {prepared(**options).id for options in ({}, {"mass": 0.2}, {"mass": 0.3}, {"friction": 0.2})}
    assert len(ids) == 4
    assert all(len(each) == 32 and int(each, 16) >= 0 for each in ids)
    document = prepared(mass=0.2).to_document()
    assert document["id"] == object_id(mesh.content_hash, ObjectOptions.from_document(document["options"]))
    assert (document["report"], document["source"]["unit"]) == (None, "m")
