"""The second engine on a grasp that holds and on one that cannot, and what the section says of verdicts."""

from dataclasses import replace

import numpy as np
import pytest

from fingersplit.hands.hand import load_hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.verification.published import Execution
from fingersplit_bench.second_engine.disagreements import cause_of, disagreement_table

pytest.importorskip("pydrake", exc_type=ImportError)

from fingersplit_bench.second_engine.section import agreement_table, compare, in_drake
from fingersplit_bench.second_engine.trials import TrialGrasp
from fingersplit_bench.second_engine.world import build_world, hydroelastic_modulus


@pytest.fixture(scope="module")
def box() -> ObjectModel:
    return prepare_object(PARAMETRIC_OBJECTS["box"](), "box")


@pytest.fixture(scope="module")
def trial(box):
    hand = load_hand("barrett")
    result = plan(box, hand, starts=16, seed=1, top_k=1)
    first = result.grasps[0]
    return TrialGrasp("box", "planned", 1, first.for_hand(hand), Execution.of_result(first, hand), box.mass, 0.6)


def test_both_engines_hold_a_planned_grasp_and_move_it_alike(box, trial):
    row = compare(load_hand("barrett"), box, decompose(box.mesh), trial)
    mujoco, drake = row["mujoco"], row["drake"]
    assert (mujoco["reason"], drake["reason"]) == ("held", "held")
    assert drake["slip"] == pytest.approx(mujoco["slip"], abs=1e-3)
    assert drake["closing"] == pytest.approx(mujoco["closing"], abs=2e-3)
    planned = np.linalg.norm(trial.execution.grip.forces, axis=1)
    weight = 9.81 * box.mass  # what the fingers carry beside the grip
    assert np.abs(np.array(drake["forces"]) - planned).max() < weight + 0.25 * planned.max()
    assert drake["lost"] == ()


def test_a_hopeless_grasp_is_lost(box, trial):
    """Without friction to speak of, the weight of a heavy object is more than fingers beside it can carry."""
    outcome = in_drake(load_hand("barrett"), box, replace(trial, friction=0.02, mass=10 * box.mass))
    assert not outcome.held
    assert outcome.reason in ("slipped", "rotated", "object_pushed")


def test_the_world_has_the_masses_and_the_pose_of_the_plan(box, trial):
    hand = load_hand("barrett")
    world = build_world(hand, box, trial.grasp, trial.execution, mass=0.3, friction=0.6, step=0.004)
    context = world.plant.CreateDefaultContext()
    for link, body in zip(hand.model.links, world.links, strict=True):
        assert body.default_mass() == pytest.approx(link.mass)
    for joint, angle in zip(world.joints, trial.grasp.joints, strict=True):
        joint.set_angle(context, angle)
    poses = hand.pose(trial.grasp.joints, trial.grasp.object_from_palm)
    for finger, pad in enumerate(hand.pads):
        there = world.plant.EvalBodyPoseInWorld(context, world.links[pad.link]) @ pad.center
        assert there == pytest.approx(poses.pads[finger], abs=1e-9)
    inertia = world.object_body.default_spatial_inertia()
    assert inertia.get_mass() == pytest.approx(0.3)
    assert inertia.get_com() == pytest.approx(box.center_of_mass)


def test_the_modulus_gives_the_patch_of_hertz():
    radius, force = 0.007, 10.0
    depth = np.sqrt(force / (np.pi * hydroelastic_modulus(radius, force)))
    assert np.sqrt(2 * radius * depth) == pytest.approx((0.75 * force * radius / 1.5e6) ** (1 / 3))


def made_up(mujoco: bool, drake: bool, probes: dict | None = None) -> dict:
    engine = {"phase": "lift", "closing": 0.001, "closing_turn": 0.0, "slip": 0.002, "turn": 0.1, "lost": []}
    sides = {
        name: {"held": held, "reason": "held" if held else "slipped", **engine}
        for name, held in (("mujoco", mujoco), ("drake", drake))
    }
    return {"object": "box", "kind": "planned", "rank": 1, **sides, "probes": probes}


def test_agreement_is_counted_by_kind():
    rows = [made_up(True, True), made_up(True, True), made_up(False, False), made_up(True, False)]
    lines = agreement_table(rows).splitlines()
    assert "| planned | 4 | 2 | 1 | 0 | 1 | 75.0% |" in lines
    assert "| slippery | 0 | 0 | 0 | 0 | 0 | - |" in lines


@pytest.mark.parametrize(
    ("probes", "cause"),
    [
        ({"mujoco": [False, True], "drake": [False, False], "pieces": True}, "at the limit"),
        ({"mujoco": [True, True], "drake": [False, True], "pieces": False}, "at the limit"),
        ({"mujoco": [True, True], "drake": [False, False], "pieces": True}, "geometry"),
        ({"mujoco": [True, True], "drake": [False, False], "pieces": False}, "contact model"),
    ],
)
def test_the_cause_of_a_disagreement_follows_from_what_changes_a_verdict(probes, cause):
    row = made_up(True, False, probes)
    assert cause_of(row) == cause
    assert f"| {cause} |" in disagreement_table([row, made_up(True, True)])


def test_agreement_leaves_no_table_of_disagreements():
    assert disagreement_table([made_up(True, True)]) == "None."
