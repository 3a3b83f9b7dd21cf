"""Proving a plan: in order, until enough hold, and the document says so."""

import numpy as np
import pytest

from fingersplit.errors import SettingsError
from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.planning.proving import prove
from fingersplit_client.schemas import PlanResult


@pytest.fixture(scope="module")
def found(prepared, barrett):
    return plan(prepared("wedge"), barrett, starts=16, seed=1, top_k=8)


@pytest.fixture(scope="module")
def pieces(found):
    return decompose(found.model.mesh, 32, 5_000)


def test_grasps_are_tried_in_order_until_enough_hold(found, pieces):
    proven = prove(found, pieces, verified=2, initial=True)
    reports = [grasp.verification for grasp in proven.grasps]
    tried = [report for report in reports if report is not None]
    assert reports[: len(tried)] == tried
    assert sum(report.passed for report in tried) == proven.proof.held == 2
    assert tried[-1].passed
    assert proven.proof.tried == len(tried)
    document = proven.to_document()
    assert PlanResult.model_validate(document).model_dump(mode="json") == document
    assert document["summary"]["verification"]["message"].endswith(f"{len(tried)} tried grasps held lift; 2 wanted.")
    assert document["grasps"][0]["initial"]["verification"]["protocol"] == "lift"
    assert found.to_document()["summary"]["verification"] is None


def test_outcome_does_not_depend_on_the_number_of_threads(found, pieces):
    alone, together = (prove(found, pieces, verified=3, threads=threads, friction=0.25) for threads in (1, 3))
    assert (alone.proof.tried, alone.proof.held) == (together.proof.tried, together.proof.held)
    for one, other in zip(alone.grasps, together.grasps, strict=True):
        assert (one.verification is None) == (other.verification is None)
        if one.verification is not None:
            assert one.verification.branches == other.verification.branches


def test_list_ends_and_deadline_ends(found, pieces):
    slippery = prove(found, pieces, verified=1, protocol="gravity_six", friction=0.01)
    assert (slippery.proof.held, slippery.proof.tried) == (0, len(found.grasps))
    late = prove(found, pieces, verified=1, deadline=0.0)
    assert (late.proof.tried, late.proof.out_of_time) == (0, True)
    assert late.to_document()["summary"]["verification"]["message"].endswith("Time ran out.")
    assert all(grasp.verification is None for grasp in late.grasps)


def test_grip_is_planned_for_the_friction_of_the_plan(prepared, barrett, pieces):
    careful = plan(prepared("wedge"), barrett, starts=16, seed=1, top_k=1, friction=0.4)
    alone = prove(careful, pieces, verified=1).grasps[0].verification
    elsewhere = prove(careful, pieces, verified=1, friction=0.2).grasps[0].verification
    assert (alone.settings["friction"], alone.settings["planned_friction"]) == ([0.4] * 3, 0.4)
    assert (elsewhere.settings["friction"], elsewhere.settings["planned_friction"]) == ([0.2] * 3, 0.4)
    np.testing.assert_array_equal(alone.grip.forces, elsewhere.grip.forces)


def test_nonsense_is_refused(found, pieces):
    for options in ({"verified": 0}, {"verified": 1, "threads": 0}, {"verified": 1, "protocol": "drop"}):
        with pytest.raises(SettingsError):
            prove(found, pieces, **options)


def test_mass_makes_the_difference(found, pieces):
    light, heavy = (prove(found, pieces, verified=1, mass=mass) for mass in (0.05, 50.0))
    assert light.proof.held == 1
    assert heavy.proof.held == 0
    assert np.isclose(light.grasps[0].verification.settings["mass"], 0.05)
