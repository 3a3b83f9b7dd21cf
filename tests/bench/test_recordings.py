"""What the section about recordings measures on: objects and runs brought to one size."""

import numpy as np
import pytest
import trimesh

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS, cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit_bench.calls import plan_once
from fingersplit_bench.recordings import measure_recording, refined, resampled


@pytest.mark.parametrize("name", ["box", "l_bracket", "mug"])
def test_a_refined_object_is_the_same_surface(name):
    mesh = PARAMETRIC_OBJECTS[name]()
    fine = refined(mesh, 9_001)
    assert len(fine.vertices) == 9_001
    assert fine.trimesh.is_watertight
    assert fine.trimesh.volume == pytest.approx(mesh.trimesh.volume)
    assert fine.trimesh.area == pytest.approx(mesh.trimesh.area)
    assert fine.trimesh.edges_unique_length.max() < mesh.trimesh.edges_unique_length.max()
    assert len(refined(fine, 5_000).vertices) == 9_001


def test_edges_of_a_face_alone_are_halved_too():
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    fine = refined(Mesh(sheet.vertices, sheet.faces), 40).trimesh
    assert (len(fine.vertices), fine.area) == (40, pytest.approx(1.0))


def test_a_resampled_run_begins_and_ends_as_it_did(barrett):
    trace = plan_once(prepare_object(cylinder(), "cylinder"), barrett, starts=4).runs[0].trace
    for states in (2, len(trace), 3 * len(trace)):
        again = resampled(trace, states)
        assert len(again) == states
        for row in (0, -1):
            np.testing.assert_array_equal(again.contacts[row], trace.contacts[row])
    np.testing.assert_array_equal(resampled(trace, len(trace)).scores, trace.scores)


def test_a_measured_recording_says_where_its_time_went(barrett):
    (row,) = measure_recording("cylinder", cylinder(), barrett, repeats=1)
    assert row["vertices"] == 20_000
    assert len(row["ms"]) == 4
    assert row["frames"] > 100
    assert 0 < row["closing_share"] < 1
    assert 0.5 < row["mb"] < 1.5
