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
from fingersplit.result import PlanResult
from fingersplit.scene import Constraints, Scene, SupportSurface
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
