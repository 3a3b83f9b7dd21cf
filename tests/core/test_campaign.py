"""Every object with default arguments: feasible grasps that are what they claim, or a precise reason why not."""

import numpy as np
import pytest

from fingersplit.objects.surface_kernel import touch
from fingersplit.planning.planning import plan
from fingersplit_client.schemas import PlanResult

pytestmark = pytest.mark.campaign


def test_object_is_grasped_or_it_is_said_why_not(every_object, barrett, verify_grasp):
    result = plan(every_object, barrett)
    document = result.to_dict()
    PlanResult.model_validate(document)
    feasible = [grasp for grasp in document["grasps"] if grasp["feasible"]]
    for grasp in feasible:
        verify_grasp(every_object, grasp)
    if not feasible:
        assert document["summary"]["message"].startswith(("None of", "No parallel grasp exists"))


def test_touch_is_the_distance_to_the_triangles(every_object, exact_mesh):
    surface, rng = every_object.surface, np.random.default_rng(0)
    picked = rng.integers(len(surface.normals), size=300)
    queries = surface.grid.points[picked] + rng.uniform(3e-3, 12e-3, (300, 1)) * surface.normals[picked]
    exact = exact_mesh(every_object.mesh).distance(queries)
    clear = exact > 2e-3  # where the normal does not lead into another part of the object
    error = np.array([touch(surface, tuple(query), -1)[0] for query in queries]) - exact
    assert np.percentile(np.abs(error[clear]), 99) < 0.3e-3
    assert error.min() > -1e-12
