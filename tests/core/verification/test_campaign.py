"""Every object: its grasps hold, that does not hang on the time step, and what must drop is dropped."""

import pytest

from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.planning.proving import prove
from fingersplit.verification import verify
from fingersplit.verification.protocols import load_protocol

pytestmark = pytest.mark.campaign


@pytest.fixture(scope="module")
def found(every_object, barrett):
    """The object's plan with three grasps that hold, and its pieces."""
    pieces = decompose(every_object.mesh)
    return prove(plan(every_object, barrett), pieces, verified=3), pieces


def test_some_ranked_grasp_holds_and_half_the_time_step_agrees(found, barrett, record_property):
    plan, pieces = found
    assert plan.proof.held >= 1, plan.proof
    fine = load_protocol("lift", {"time_step": 0.001})
    tried = [grasp for grasp in plan.grasps if grasp.verification]
    changed = [
        verify(grasp.run.final, barrett, plan.model, pieces, fine).passed != grasp.verification.passed
        for grasp in tried
    ]
    record_property("share of verdicts that change", sum(changed) / len(changed))
    held = [not change for grasp, change in zip(tried, changed, strict=True) if grasp.verification.passed]
    assert all(held)


def test_friction_of_a_twelfth_of_the_planned_drops_it(found, barrett):
    plan, pieces = found
    grasp = plan.grasps[0].run.final
    assert not verify(grasp, barrett, plan.model, pieces, "gravity_six", friction=0.05).passed
