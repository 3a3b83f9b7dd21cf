"""Prepared objects survive the cache, field by field, and are loaded, not prepared again."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest

from fingersplit.cache import ContentCache
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel, object_id
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.packing import frozen, packed, unpacked
from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_cached, prepare_object
from fingersplit.objects.signed_distance_kernel import rough_distance
from fingersplit.objects.source import ObjectSource
from fingersplit.objects.surface_kernel import closest, touch


class Inner(NamedTuple):
    points: np.ndarray
    shape: tuple[int, int]
    place: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Outer:
    inner: Inner
    count: int
    size: float
    name: str
    closed: bool


def test_nested_values_are_taken_apart_and_put_together():
    value = Outer(Inner(np.eye(3), (4, 5), (0.1, 0.2, 0.3)), 7, 0.5, "tool", True)
    arrays = packed(value, "a/")
    assert sorted(arrays) == [
        "a/closed",
        "a/count",
        "a/inner/place",
        "a/inner/points",
        "a/inner/shape",
        "a/name",
        "a/size",
    ]
    again = unpacked(Outer, arrays, "a/")
    assert (again.count, again.size, again.name, again.closed) == (7, 0.5, "tool", True)
    assert (again.inner.shape, again.inner.place) == ((4, 5), (0.1, 0.2, 0.3))
    assert [type(part) for part in (again.count, again.size, again.inner.shape[0])] == [int, float, int]
    np.testing.assert_array_equal(again.inner.points, np.eye(3))
    with pytest.raises(KeyError):
        unpacked(Outer, {}, "a/")
    assert not frozen(value).inner.points.flags.writeable


@pytest.fixture
def cache(tmp_path) -> ContentCache:
    return ContentCache(tmp_path, 100_000_000)


def test_model_is_prepared_once_and_comes_back_whole(cache):
    mesh, loads = cylinder(), []

    def load() -> Mesh:
        loads.append(1)
        return mesh

    options = ObjectOptions(mass=0.2)
    key, source = object_id(mesh.content_hash, options), ObjectSource("mm", 2.0)
    first = prepare_cached(cache, key, load, "first", options, source)
    again = prepare_cached(cache, key, load, "again", options, source)
    assert (len(loads), first.name, again.name) == (1, "first", "again")
    fresh = prepare_object(mesh, "fresh", options, source)
    for model in first, again:
        assert model.to_document() == fresh.to_document() | {"name": model.name}
        assert (model.options, model.radius) == (options, fresh.radius)
        for name, array in fresh.to_arrays().items():
            np.testing.assert_array_equal(model.to_arrays()[name], array, err_msg=name)
            assert not model.to_arrays()[name].flags.writeable or array.ndim == 0 or array.size < 10, name
    heavier = ObjectOptions(mass=0.3)
    assert prepare_cached(cache, object_id(mesh.content_hash, heavier), load, "other", heavier).mass == 0.3
    assert len(loads) == 2


def test_loaded_model_runs_the_kernels_that_were_compiled_for_a_prepared_one(cache):
    mesh = cylinder()
    query = (0.1, 0.02, 0.03)

    def look_up(model: ObjectModel) -> list:
        surface, distance = model.surface, model.distance
        return [closest(surface, query, -1), touch(surface, query, -1), rough_distance(distance, query)]

    fresh = look_up(prepare_object(mesh))
    compiled = [len(function.signatures) for function in (closest, touch, rough_distance)]
    prepare_cached(cache, mesh.content_hash, lambda: mesh)
    loaded = look_up(prepare_cached(cache, mesh.content_hash, lambda: mesh))
    assert loaded == fresh
    assert [len(function.signatures) for function in (closest, touch, rough_distance)] == compiled
