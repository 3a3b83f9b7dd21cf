"""Sources of parallel grasps: known by name, and a new one is one file that plans can start from."""

import numpy as np
import pytest

from fingersplit.errors import SettingsError
from fingersplit.parallel_grasps import sources
from fingersplit.parallel_grasps.sources import available_sources, find_parallel_grasps
from fingersplit.planning.planning import plan

SAME = '''"""The same two grasps for every object."""

import numpy as np

from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.source import ParallelGraspSource

__all__ = ["SAME"]

CONTACTS = [[[0.025, 0, 0.01], [-0.025, 0, 0.01]], [[0, 0.035, 0], [0, -0.035, 0]]]


def _find(request):
    assert request.friction == 0.45 and request.starts == 3
    return ParallelGrasps(np.array(CONTACTS), np.tile([0.0, 0.0, -1.0], (2, 1)))


SAME = ParallelGraspSource("same", "The same two grasps.", _find)
'''


@pytest.fixture
def with_same(tmp_path, monkeypatch):
    (tmp_path / "same.py").write_text(SAME)
    monkeypatch.setattr(sources, "__path__", [*sources.__path__, str(tmp_path)])
    available_sources.cache_clear()
    yield
    monkeypatch.undo()
    available_sources.cache_clear()


def find(prepared, source, threads=1):
    return find_parallel_grasps(
        prepared("box"),
        16,
        source=source,
        friction=0.6,
        opening=(0.0, 0.2),
        rng=np.random.default_rng(3),
        threads=threads,
    )


@pytest.mark.parametrize("source", available_sources())
def test_every_source_finds_grasps_whatever_the_threads(prepared, source):
    one, two = find(prepared, source), find(prepared, source, threads=2)
    assert len(one) >= 8
    np.testing.assert_array_equal(one.contacts, two.contacts)
    np.testing.assert_array_equal(one.approaches, two.approaches)


def test_a_new_source_is_one_file(with_same, prepared, barrett):
    assert list(available_sources()) == ["antipodal", "both", "same", "surface_fitting"]
    found = plan(prepared("box"), barrett, source="same", starts=3, friction=0.45)
    assert found.provenance.parallel_grasps == "same"
    starts = {tuple(np.round(np.ptp(grasp.initial.parallel_grasp.contacts, axis=0), 6)) for grasp in found.grasps}
    assert starts <= {(0.05, 0.0, 0.0), (0.0, 0.07, 0.0)}
    assert starts


def test_unknown_sources_are_refused(prepared):
    with pytest.raises(SettingsError, match=r"Unknown source .* 'guess'; known: antipodal, both, surface_fitting"):
        find(prepared, "guess")
