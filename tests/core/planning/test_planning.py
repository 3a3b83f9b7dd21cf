"""The whole way: document, reproducibility, given parallel grasps, messages, and every claim checked independently."""

import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest

from fingersplit.errors import ParallelGraspError, SettingsError
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.parallel_grasps import ParallelGrasp
from fingersplit.planning.planning import plan
from fingersplit.planning.search import find_grasps
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.transforms import rotation_from_wxyz
from fingersplit_client.schemas import PlanResult

NAMES = ("box", "cylinder", "mug", "sphere")


@pytest.fixture(scope="module")
def planned(barrett, prepared):
    plans = {name: plan(prepared(name), barrett, starts=24, seed=1) for name in NAMES}
    return plans.__getitem__


def without_times(document: dict) -> dict:
    copy = json.loads(json.dumps(document))
    copy["timings_ms"] = None
    for grasp in copy["grasps"]:
        grasp["timings_ms"] = None
    return copy


@pytest.mark.parametrize("name", NAMES)
def test_document_is_that_of_the_client(planned, name):
    document = planned(name).to_dict()
    over_the_wire = json.loads(json.dumps(document, allow_nan=False))
    assert PlanResult.model_validate(over_the_wire).model_dump(mode="json") == over_the_wire


@pytest.mark.parametrize("name", NAMES)
def test_summary_adds_up(planned, barrett, prepared, name):
    result, found = planned(name), find_grasps(prepared(name), barrett, starts=24, seed=1)
    document = result.to_dict()
    summary = document["summary"]
    assert summary["started"] == len(found.runs) <= 24
    assert sum(summary["terminations"].values()) == summary["started"]
    assert summary["feasible"] == result.feasible == found.feasible > 0
    assert summary["message"] == f"{result.feasible} of {len(found.runs)} starts ended in a feasible grasp."
    times = document["timings_ms"]
    assert list(times) == ["parallel_grasps", "mapping", "splitting", "ranking", "total"]
    assert times["total"] == pytest.approx(sum(times.values()) - times["total"])
    assert sum(run.seconds[-1] for run in found.runs) <= found.seconds["splitting"]
    assert sum(grasp["timings_ms"]["total"] for grasp in document["grasps"]) <= times["splitting"]


@pytest.mark.parametrize("name", NAMES)
def test_grasps_are_ranked_and_differ(planned, name):
    grasps = planned(name).to_dict()["grasps"]
    assert 0 < len(grasps) <= 10
    assert [grasp["rank"] for grasp in grasps] == list(range(1, len(grasps) + 1))
    margins = [grasp["metrics"]["holding_margin"] for grasp in grasps]
    held = [-math.inf if margin is None else margin for margin in margins]
    order = [
        (
            len(grasp["violations"]),
            margin < 0,
            bool(grasp["grip"]["supporting"]),
            -grasp["p_hold"]["value"] if grasp["feasible"] else -margin,
        )
        for grasp, margin in zip(grasps, held, strict=True)
    ]
    assert order == sorted(order)
    for grasp, margin in zip(grasps, held, strict=True):
        assert grasp["feasible"] == grasp["geometry_valid"] == (not grasp["violations"])
        assert grasp["carries_weight"] == (margin >= 0)
    carrying = [grasp["carries_weight"] for grasp in grasps if grasp["geometry_valid"]]
    assert carrying == sorted(carrying, reverse=True)
    positions = np.array([grasp["palm"]["position"] for grasp in grasps])
    quaternions = np.array([grasp["palm"]["wxyz"] for grasp in grasps])
    for i in range(len(grasps)):
        for k in range(i):
            turn = 2 * np.arccos(min(1.0, abs(quaternions[i] @ quaternions[k])))
            assert np.linalg.norm(positions[i] - positions[k]) >= 5e-3 or turn >= 0.1


@pytest.mark.parametrize("name", NAMES)
def test_metrics_are_those_of_the_contacts(planned, name):
    for grasp in planned(name).to_dict()["grasps"]:
        a, b, c = (np.array(contact["position"]) for contact in grasp["contacts"])
        metrics = grasp["metrics"]
        assert metrics["object_quality"] == pytest.approx(np.linalg.norm(np.cross(b - a, c - a)))
        assert metrics["quality"] == pytest.approx(metrics["object_quality"] + metrics["manipulability"])
        assert metrics["manipulability"] <= 0
        margin, forces = metrics["holding_margin"], [contact["force"] for contact in grasp["contacts"]]
        assert (margin is not None and margin > 0) == (None not in forces)


@pytest.mark.parametrize("name", NAMES)
def test_reasons_tell_margin_and_weight(planned, prepared, name):
    weight = 9.81 * prepared(name).mass
    for grasp in planned(name).to_dict()["grasps"]:
        margin, reason = grasp["metrics"]["holding_margin"], grasp["reason"]
        assert reason.endswith(".")
        if not grasp["feasible"]:
            assert reason == f"Ranked after every feasible grasp: {grasp['violations'][0]}"
        elif margin is None:
            assert reason.startswith("Cannot balance the object's weight")
        else:
            said = (
                f"minimum friction margin {margin:.2f} N" if margin >= 0 else f"lack {-margin:.2f} N of friction force"
            )
            assert said in reason
            assert f"{weight:.2f} N" in reason
            assert re.search(r"gravity along [+-][xyz]", reason, re.IGNORECASE)
        assert (grasp["pregrasp"] is None and grasp["feasible"]) == ("No collision-free straight approach" in reason)


@pytest.mark.parametrize("name", NAMES)
def test_pregrasp_and_squeeze_belong_to_the_grasp(planned, barrett, name):
    free = 0
    for grasp in planned(name).to_dict()["grasps"]:
        assert list(grasp["squeeze_joints"]) == list(barrett.joint_names)
        assert grasp["squeeze_joints"] != grasp["joints"]
        if grasp["pregrasp"] is not None:
            free += 1
            assert list(grasp["pregrasp"]["joints"]) == list(barrett.joint_names)
            np.testing.assert_allclose(grasp["pregrasp"]["palm"]["wxyz"], grasp["palm"]["wxyz"], atol=1e-12)
            way = np.subtract(grasp["palm"]["position"], grasp["pregrasp"]["palm"]["position"])
            assert np.linalg.norm(way) == pytest.approx(0.1)
            assert rotation_from_wxyz(grasp["palm"]["wxyz"])[:, 2] @ way >= 0.1 * np.cos(0.7)  # the largest tilt
    assert free > 0


@pytest.mark.parametrize("name", NAMES)
def test_forces_carry_the_object_from_inside_the_cones(planned, prepared, name):
    model, carried = prepared(name), 0
    for grasp in planned(name).to_dict()["grasps"]:
        forces = [contact["force"] for contact in grasp["contacts"]]
        if None in forces:
            assert forces == [None] * 3
            continue
        forces, carried = np.array(forces), carried + 1
        normals = np.array([contact["normal"] for contact in grasp["contacts"]])
        positions = np.array([contact["position"] for contact in grasp["contacts"]])
        assert np.linalg.norm(forces.sum(axis=0)) == pytest.approx(9.81 * model.mass)
        np.testing.assert_allclose(np.cross(positions - model.center_of_mass, forces).sum(axis=0), 0, atol=1e-6)
        pressed = -(forces * normals).sum(axis=1)
        assert (np.linalg.norm(forces + pressed[:, None] * normals, axis=1) <= 0.6 * pressed + 1e-6).all()
    assert carried > 0


@pytest.mark.parametrize("name", NAMES)
def test_every_feasible_grasp_is_what_it_claims(planned, prepared, verify_grasp, name):
    document = planned(name).to_dict()
    feasible = [grasp for grasp in document["grasps"] if grasp["feasible"]]
    assert feasible
    for grasp in feasible:
        verify_grasp(prepared(name), grasp)


@pytest.mark.parametrize("name", NAMES)
def test_initial_state_is_consistent(planned, barrett, mujoco_barrett, name):
    for grasp in planned(name).to_dict()["grasps"]:
        initial = grasp["initial"]
        mujoco_barrett.move(initial["joints"], initial["palm"]["wxyz"], initial["palm"]["position"])
        for contact in initial["contacts"]:
            assert contact["force"] is None
            center, _ = mujoco_barrett.site(f"{contact['finger']}_pad")
            reach = np.linalg.norm(np.array(contact["fingertip"]) - center)
            assert reach == pytest.approx(barrett.fingers[0].pad_radius, abs=1e-9)
        assert initial["quality"] < grasp["metrics"]["quality"] + 1e-3


def test_same_seed_gives_the_same_document(barrett, prepared, planned):
    again = plan(prepared("mug"), barrett, starts=24, seed=1)
    assert without_times(again.to_dict()) == without_times(planned("mug").to_dict())


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_do_not_change_the_document(barrett, prepared, threads):
    one = plan(prepared("mug"), barrett, starts=80, seed=1)
    several = plan(prepared("mug"), barrett, starts=80, seed=1, threads=threads)
    assert without_times(several.to_dict()) == without_times(one.to_dict())


@pytest.mark.parametrize("fidelity", ["default", "paper"])
def test_fidelity_reaches_the_runs(barrett, prepared, fidelity):
    result = find_grasps(prepared("box"), barrett, starts=8, settings=PlannerSettings.of(fidelity))
    assert result.runs
    for run in result.runs:
        assert bool(run.problem.settings.potentials) == (fidelity == "default")
        assert run.problem.settings.time_step == {"default": 1.0, "paper": 0.05}[fidelity]


def test_another_process_gives_the_same_document(planned):
    program = (
        "import json; from fingersplit.hands import load_hand;"
        "from fingersplit.objects.preparing import prepare_object;"
        "from fingersplit.objects.parametric import mug; from fingersplit.planning.planning import plan;"
        "model = prepare_object(mug(), 'mug');"
        "print(json.dumps(plan(model, load_hand('barrett'), starts=24, seed=1).to_dict()))"
    )
    finished = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert without_times(json.loads(finished.stdout)) == without_times(planned("mug").to_dict())


def test_another_seed_gives_other_grasps(barrett, prepared, planned):
    other = plan(prepared("mug"), barrett, starts=24, seed=2)
    assert other.to_dict()["grasps"][0]["palm"] != planned("mug").to_dict()["grasps"][0]["palm"]


def test_given_parallel_grasps_are_the_ones_started_from(barrett, prepared):
    given = [
        ParallelGrasp([[0.025, 0, z], [-0.025, 0, z]], approach)
        for z in (0.0, 0.02)
        for approach in ([0, 0, -1], [0, 1, 0], [0, -1, 0])
    ]
    result = plan(prepared("box"), barrett, given)
    assert 0 < result.summary.started <= 2 * len(given)  # either finger assignment
    documents = [grasp.to_document() for grasp in given]
    for grasp in result.to_dict()["grasps"]:
        assert grasp["initial"]["parallel_grasp"] in documents


def test_top_k_limits_the_answer(barrett, prepared):
    result = plan(prepared("sphere"), barrett, starts=12, top_k=3)
    assert len(result.grasps) == 3
    assert result.summary.started == 12


def test_settings_reach_the_run(barrett, prepared):
    strict = PlannerSettings(max_outer_iterations=1, pad_angle_limit=0.3)
    result = plan(prepared("sphere"), barrett, starts=8, settings=strict)
    for grasp in result.to_dict()["grasps"]:
        assert grasp["iterations"]["outer"] == 1
        assert not grasp["feasible"] or max(contact["pad_angle"] for contact in grasp["contacts"]) <= 0.3


def test_progress_tells_the_stages_in_order(barrett, prepared):
    told = []
    plan(prepared("sphere"), barrett, starts=4, progress=lambda stage, share: told.append((stage, share)))
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages == ["parallel_grasps", "mapping", "splitting", "ranking"]
    for stage in stages:
        shares = [share for told_stage, share in told if told_stage == stage]
        assert shares == sorted(shares)
        assert 0 <= shares[0] <= shares[-1] <= 1
    assert told[-1] == ("ranking", 1.0)


def test_too_large_an_object_has_no_parallel_grasp(barrett):
    result = plan(prepare_object(box((0.3, 0.35, 0.4)), "crate"), barrett, starts=8)
    document = result.to_dict()
    assert document["grasps"] == []
    assert document["summary"]["started"] == 0
    assert document["summary"]["message"].startswith("No parallel grasp exists to start from")
    assert "opening of 0 to 200 mm" in document["summary"]["message"]
    assert PlanResult.model_validate(document).grasps == []


def test_grasps_out_of_reach_are_said_to_be(barrett):
    cube = prepare_object(box((0.5, 0.5, 0.5)), "cube")
    with pytest.raises(ParallelGraspError, match=r"grasp 1 lies 5\.1 mm from the surface"):
        plan(cube, barrett, [ParallelGrasp([[0.2551, 0, 0], [-0.25, 0, 0]], [0, 0, -1])])
    result = plan(cube, barrett, [ParallelGrasp([[0.25, 0, 0], [-0.25, 0, 0]], [0, 0, -1])])
    assert result.to_dict()["grasps"] == []
    assert result.message.startswith("None of the 1 parallel grasps could be taken over by the hand")


@pytest.mark.parametrize("source", ["surface_fitting", "both"])
def test_every_source_leads_to_feasible_grasps(barrett, prepared, source):
    result = find_grasps(prepared("box"), barrett, source=source, starts=16, seed=2)
    assert result.feasible > 0
    again = find_grasps(prepared("box"), barrett, source=source, starts=16, seed=2)
    assert [run.final.joints.tolist() for run in again.runs] == [run.final.joints.tolist() for run in result.runs]


def test_nothing_feasible_says_why_and_shows_the_best(barrett, prepared):
    result = plan(prepared("cylinder"), barrett, starts=6, settings=PlannerSettings(pad_angle_limit=0.0))
    assert result.feasible == 0
    document = result.to_dict()
    assert document["summary"]["message"].startswith(
        f"None of {result.summary.started} starts ended in a feasible grasp: "
    )
    assert "pad angle violated" in document["summary"]["message"]
    assert len(document["grasps"]) > 0
    for grasp in document["grasps"]:
        assert not grasp["feasible"]
        assert grasp["violations"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"starts": 0}, r"starts is 0; it must be at least 1"),
        ({"top_k": -1}, r"top_k is -1; it must be at least 1"),
        ({"seed": -1}, r"seed is -1; it must be at least 0"),
        ({"threads": 0}, r"threads is 0; it must be at least 1"),
        ({"source": "luck"}, r"Unknown source of parallel grasps 'luck'; known: antipodal, both, surface_fitting"),
    ],
)
def test_arguments_out_of_range_are_refused(barrett, prepared, arguments, message):
    with pytest.raises(SettingsError, match=message):
        plan(prepared("sphere"), barrett, **arguments)


def test_a_grasp_that_cannot_carry_the_object_says_so_and_ranks_last(barrett):
    heavy = prepare_object(box(), "anvil", ObjectOptions(mass=40.0))
    result = plan(heavy, barrett, starts=16, seed=1)
    valid = [grasp for grasp in result.grasps if grasp.geometry_valid]
    assert valid
    assert not any(grasp.carries_weight for grasp in valid)
    assert all(grasp.reason.startswith("Cannot ") for grasp in valid)
    assert result.message.endswith("None of the ranked grasps can support the object's weight in every direction.")
