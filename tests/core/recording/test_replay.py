"""A stored grasp comes back with its history, and only with the object, hand and settings it was planned with."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fingersplit.errors import ResultError, SettingsError
from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.planning.search import find_grasps
from fingersplit.recording.replay import replay
from fingersplit.recording.series import RecordedFrames
from fingersplit.recording.web_scene import motion_scene
from fingersplit.result import PlanResult
from fingersplit.scene import Constraints, Pose, Scene, SupportSurface
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.verification import simulate, verify_ranked
from fingersplit.verification.published import Execution

OPTIONS = {"starts": 16, "seed": 3, "top_k": 3}


@pytest.fixture(scope="module")
def model(prepared):
    return prepared("cylinder")


def stored(result):
    """The result as it comes back from a file."""
    return PlanResult.from_dict(json.loads(json.dumps(result.to_dict())))


@pytest.mark.parametrize("fidelity", ["default", "paper"])
def test_the_history_is_that_of_the_run_that_found_the_grasp(model, barrett, fidelity):
    settings = PlannerSettings.of(fidelity, pad_angle_limit=0.55)
    result = stored(plan(model, barrett, settings=settings, **OPTIONS))
    found = find_grasps(model, barrett, settings=settings, **OPTIONS)
    for ranked in found.grasps:
        replayed = replay(result, ranked.rank, model, barrett)
        np.testing.assert_array_equal(replayed.trace.joints, ranked.run.trace.joints)
        np.testing.assert_array_equal(replayed.trace.scores, ranked.run.trace.scores)
        assert len(replayed.curve.quality) == len(replayed.curve.phases) == len(replayed.trace)
        assert replayed.curve.phases[0] == "map"
        assert (replayed.frames, replayed.initial_frames) == (None, None)


def test_the_simulations_are_those_that_verified_the_grasp(model, barrett):
    pieces = decompose(model.mesh)
    planned = plan(model, barrett, friction=0.5, **OPTIONS)
    options = {"protocol": "gravity_six", "controller": "joint_torque", "friction": 0.45}
    result = stored(verify_ranked(planned, model, barrett, pieces, verified=1, initial=True, **options))
    replayed = replay(result, 1, model, barrett, lambda: pieces)
    first = result.grasps[0]
    published = Execution.of_result(first, barrett)
    for grasp, execution, frames in (
        (first, published, replayed.frames),
        (first.initial, None, replayed.initial_frames),
    ):
        options |= {"planned_friction": 0.5, "execution": execution}
        again = simulate(grasp.for_hand(barrett), barrett, model, pieces, **options).frames
        np.testing.assert_allclose(frames.object_positions, again.object_positions, atol=1e-6)
    assert replay(result, 1, model, barrett).frames is None


def refused(result, model, hand, error, said):
    with pytest.raises(error, match=said):
        replay(result, 1, model, hand)


def test_what_is_not_the_result_any_more_is_refused(model, barrett, prepared):
    result = plan(model, barrett, **OPTIONS)
    origin = result.provenance
    refused(result, prepared("box"), barrett, ResultError, "The object is not the one of the result")
    altered = replace(result, provenance=replace(origin, hand_sha256="0" * 64))
    refused(altered, model, barrett, ResultError, "description of the hand 'barrett' was altered")
    other = replace(result, provenance=replace(origin, planner=origin.planner | {"cpo_trust_region": 0.01}))
    refused(other, model, barrett, ResultError, "The grasp of rank 1 could not be reproduced")
    unknown = replace(result, provenance=replace(origin, planner=origin.planner | {"haste": 2}))
    refused(unknown, model, barrett, SettingsError, "Unknown planner setting 'haste'")
    with pytest.raises(ResultError, match="has 3 grasps and none of rank 9"):
        replay(result, 9, model, barrett)


def test_a_grasp_planned_in_a_scene_comes_back(model, barrett):
    constraints = Constraints(Scene(support_surfaces=(SupportSurface(),)))
    result = stored(plan(model, barrett, constraints=constraints, **OPTIONS))
    assert result.provenance.constraints["scene"]["support_surfaces"][0]["id"] == "table"
    assert replay(result, 1, model, barrett).grasp == result.grasps[0]


def test_a_pick_is_shown_as_it_was_reported(prepared, barrett):
    model = prepared("box")
    pose = Pose((0.3, 0.1, -float(model.mesh.vertices[:, 2].min())), (np.cos(0.4), 0.0, 0.0, np.sin(0.4)))
    constraints = Constraints(Scene(object_pose=pose, support_surfaces=(SupportSurface(),)))
    pieces = decompose(model.mesh)
    planned = plan(model, barrett, constraints=constraints, **OPTIONS)
    result = stored(verify_ranked(planned, model, barrett, pieces, verified=1, protocol="pick"))
    grasp = next(one for one in result.grasps if one.verification is not None and one.verification.passed)
    frames = replay(result, grasp.rank, model, barrett, lambda: pieces).frames
    names = [frames.phase_names[phase] for phase in frames.phases]
    assert list(dict.fromkeys(names)) == ["settle", "approach", "close", "squeeze", "rest", "lift", "hold"]
    assert frames.closing == names.index("close")
    reported = grasp.verification.settings["pick"]
    # In the object's frame the hand reaches the grasp, and then leaves with the object.
    planned_palm = grasp.for_hand(barrett).object_from_palm[:3, 3]
    np.testing.assert_allclose(frames.palm_positions[frames.closing], planned_palm, atol=1e-3)
    begun = planned_palm - grasp.approach_path.distance * np.array(grasp.approach_path.direction)
    np.testing.assert_allclose(frames.palm_positions[0], begun, atol=1e-3)
    raised = (frames.object_positions[-1] - frames.object_positions[names.index("lift")]) @ grasp.retreat_path.direction
    assert raised == pytest.approx(reported["lifted"], abs=1e-3)
    # The fingers press from their first touch on, and carry the weight in the end.
    came = names.index("approach")
    for finger, (name, touch) in enumerate(reported["first_touches"].items()):
        pressed = np.linalg.norm(frames.contact_forces[came:, finger], axis=1) > 0
        first = frames.times[came + int(pressed.argmax())] - frames.times[came - 1]
        assert first == pytest.approx(touch, abs=0.05), name
    up = np.array([0.0, 0.0, 1.0])
    carried = frames.contact_forces[-30:].sum(axis=1).mean(axis=0)
    np.testing.assert_allclose(carried, model.mass * 9.81 * up, atol=0.1 * model.mass * 9.81)
    pads = np.array([contact.position for contact in grasp.contacts])
    np.testing.assert_allclose(frames.contact_positions[names.index("rest")], pads, atol=8e-3)
    # Slip counts from the closing on, on the page and in the recording.
    shown, recorded = motion_scene(frames), RecordedFrames(frames, barrett)
    assert shown["phases"][shown["closing"]] == "close"
    assert recorded.slips[: frames.closing].max() == 0.0
    assert recorded.slips.max() < reported["displacement"] + reported["pushed"] + 5e-3
