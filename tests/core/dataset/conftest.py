"""A planned and partly verified box, and an order whose rounds are variations of it."""

from dataclasses import replace

import pytest

from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.verification import verify_ranked


@pytest.fixture(scope="session")
def verified_box(prepared, barrett):
    model = prepared("box")
    result = plan(model, barrett, starts=12, seed=3, top_k=12)
    return verify_ranked(result, model, barrett, decompose(model.mesh), verified=2)


@pytest.fixture(scope="session")
def mixed(verified_box):
    """The same with one grasp that is not feasible, at the end."""
    *others, last = verified_box.grasps
    bad = replace(last, feasible=False, violations=("Finger finger1 lies 3 mm inside the object.",), pregrasp=None)
    return replace(verified_box, grasps=(*others, bad))
