"""Every object: its grasps hold, that does not hang on the time step, and what must drop is dropped."""

import pytest

from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.verification import verify, verify_ranked
from fingersplit.verification.protocols import load_protocol

pytestmark = pytest.mark.campaign


@pytest.fixture(scope="module")
def found(every_object, barrett):
    """The object's plan with three grasps that hold, and its pieces."""
    pieces = decompose(every_object.mesh)
    return verify_ranked(plan(every_object, barrett), every_object, barrett, pieces, verified=3), pieces


def test_some_ranked_grasp_holds_and_half_the_time_step_agrees(found, every_object, barrett, record_property):
    result, pieces = found
    assert result.summary.verification.held >= 1, result.summary.verification
    fine = load_protocol("lift", {"time_step": 0.001})
    tried = [grasp for grasp in result.grasps if grasp.verification]
    changed = [
        verify(grasp.for_hand(barrett), barrett, every_object, pieces, fine).passed != grasp.verification.passed
        for grasp in tried
    ]
    record_property("share of verdicts that change", sum(changed) / len(changed))
    held = [not change for grasp, change in zip(tried, changed, strict=True) if grasp.verification.passed]
    assert all(held)


def test_friction_of_a_twelfth_of_the_planned_drops_it(found, every_object, barrett):
    result, pieces = found
    grasp = result.grasps[0].for_hand(barrett)
    assert not verify(grasp, barrett, every_object, pieces, "gravity_six", friction=0.05).passed
