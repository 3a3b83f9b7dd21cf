"""Volume and centre of mass of solids that are open, pinched, doubled, overlapping or wound wrongly, as they were."""

import numpy as np
import pytest

from damaged_solids import damaged_solid
from field_cases import as_obj
from fingersplit.objects.intake import read_mesh


@pytest.mark.parametrize(
    "number", [*range(25), *(pytest.param(each, marks=pytest.mark.campaign) for each in range(25, 200))]
)
def test_damaged_solid_weighs_what_the_whole_one_does(number):
    damaged = damaged_solid(number)
    mesh, report = read_mesh(as_obj((damaged.vertices.tolist(), damaged.faces.tolist())), "obj")
    assert mesh.volume == pytest.approx(damaged.volume, rel=0.02), (damaged.kind, report)
    assert np.linalg.norm(mesh.center_of_mass - damaged.center) < 1e-3, (damaged.kind, report)
    assert report.volume_method != "convex_hull"
