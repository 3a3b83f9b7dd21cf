"""Verification of ranked grasps: in order, until enough hold, and the document says so."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fingersplit.errors import ResultError, SettingsError
from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.result import PlanResult
from fingersplit.verification import verify_ranked
from fingersplit_client.schemas import PlanResult as ClientResult


@pytest.fixture(scope="module")
def model(prepared):
    return prepared("wedge")


@pytest.fixture(scope="module")
def found(model, barrett):
    return plan(model, barrett, starts=16, seed=1, top_k=8)


@pytest.fixture(scope="module")
def pieces(model):
    return decompose(model.mesh, 32, 5_000)


@pytest.fixture
def verified(found, model, barrett, pieces):
    def run(result=None, **options):
        return verify_ranked(result or found, model, barrett, pieces, **options)

    return run


def without_times(result):
    """The document without how long anything took."""
    text = json.dumps(result.to_dict(), sort_keys=True)
    return json.loads(text, object_hook=lambda part: {k: v for k, v in part.items() if k != "time_ms"})


def test_grasps_are_verified_in_order_until_enough_hold(found, verified):
    result = verified(verified=2, initial=True)
    reports = [grasp.verification for grasp in result.grasps]
    tried = [report for report in reports if report is not None]
    assert reports[: len(tried)] == tried
    summary = result.summary.verification
    assert sum(report.passed for report in tried) == summary.held == 2
    assert tried[-1].passed
    assert summary.tried == len(tried)
    assert summary.message == f"2 of {len(tried)} verified grasps held (lift); 2 requested."
    document = json.loads(json.dumps(result.to_dict()))
    assert ClientResult.model_validate(document).model_dump(mode="json") == document
    assert document["grasps"][0]["initial"]["verification"]["protocol"] == "lift"
    assert found.summary.verification is None


def test_a_stored_result_is_verified_like_the_one_just_planned(found, verified):
    stored = PlanResult.from_dict(json.loads(json.dumps(found.to_dict())))
    assert without_times(verified(stored, verified=2)) == without_times(verified(verified=2))


def test_outcome_does_not_depend_on_the_number_of_threads(verified):
    alone, together = (verified(verified=3, threads=threads, friction=0.25) for threads in (1, 3))
    assert without_times(alone) == without_times(together)


def test_list_ends_and_deadline_ends(found, verified):
    slippery = verified(verified=1, protocol="gravity_six", friction=0.01).summary.verification
    assert (slippery.held, slippery.tried) == (0, len(found.grasps))
    late = verified(verified=1, deadline=0.0)
    assert late.summary.verification.tried == 0
    assert late.summary.verification.message.endswith("The deadline ended the verification.")
    assert all(grasp.verification is None for grasp in late.grasps)


def test_grip_is_planned_for_the_friction_of_the_plan(model, barrett, verified):
    careful = plan(model, barrett, starts=16, seed=1, top_k=1, friction=0.4)
    alone = verified(careful, verified=1).grasps[0].verification
    elsewhere = verified(careful, verified=1, friction=0.2).grasps[0].verification
    assert (alone.settings["friction"], alone.settings["planned_friction"]) == ([0.4] * 3, 0.4)
    assert (elsewhere.settings["friction"], elsewhere.settings["planned_friction"]) == ([0.2] * 3, 0.4)
    assert alone.grip.forces == elsewhere.grip.forces


def test_nonsense_is_refused(verified):
    for options in ({"verified": 0}, {"verified": 1, "threads": 0}, {"verified": 1, "protocol": "drop"}):
        with pytest.raises(SettingsError):
            verified(**options)


def test_another_object_is_refused(found, verified):
    other = replace(found, object=replace(found.object, id="0" * 32))
    with pytest.raises(ResultError, match="The object is not the one of the result"):
        verified(other, verified=1)


def test_mass_makes_the_difference(verified):
    light, heavy = (verified(verified=1, mass=mass) for mass in (0.05, 50.0))
    assert light.summary.verification.held == 1
    assert heavy.summary.verification.held == 0
    assert np.isclose(light.grasps[0].verification.settings["mass"], 0.05)
