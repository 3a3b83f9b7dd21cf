"""Exports say the same as the result document, in each format's own words, and name hand, hash and frames."""

import json
import pickle

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from fingersplit.errors import FormatError, ResultError
from fingersplit.formats import export as export_result
from fingersplit.formats import export_file, formats_that
from fingersplit.formats.dexgraspbench import read_dexgraspbench
from fingersplit.formats.isaac_grasp import read_isaac_grasp
from fingersplit.formats.pickled_npy import dump_npy, load_npy
from fingersplit.planning.planning import plan
from fingersplit.result import PlanResult
from fingersplit.scene import Approach, Constraints, Retreat, Scene, SupportSurface
from fingersplit.transforms import pose_matrix, rotation_from_wxyz


@pytest.fixture(scope="module")
def template(barrett, prepared):
    """The document of a real plan with one grasp."""
    return plan(prepared("box"), barrett, starts=4, seed=1, top_k=1).to_dict()


def grasp_document(hand, template, rank, feasible=True, seed=0):
    rng = np.random.default_rng(seed + rank)
    wxyz = rng.normal(size=4)
    wxyz *= np.sign(wxyz[0]) / np.linalg.norm(wxyz)
    position = rng.uniform(-0.2, 0.2, 3)
    joints = rng.uniform(hand.lower, hand.upper)
    back = position - 0.1 * rotation_from_wxyz(wxyz)[:, 2]
    grasp = json.loads(json.dumps(template["grasps"][0]))
    return grasp | {
        "rank": rank,
        "feasible": feasible,
        "palm": {"position": position.tolist(), "wxyz": wxyz.tolist()},
        "joints": hand.named(joints),
        "pregrasp": {
            "palm": {"position": back.tolist(), "wxyz": wxyz.tolist()},
            "joints": hand.named(0.9 * joints),
        },
        "squeeze_joints": hand.named(joints + 0.05),
        "metrics": grasp["metrics"] | {"ferrari_canny": 0.1 * rank},
    }


@pytest.fixture
def document(barrett, template):
    feasibility = ((1, True), (2, True), (3, False))
    grasps = [grasp_document(barrett, template, rank, feasible) for rank, feasible in feasibility]
    return template | {"object": template["object"] | {"id": "0123abcd", "name": "mug"}, "grasps": grasps}


EXPORT_FORMATS = formats_that("write")


def export(document, name, **options):
    return export_result(PlanResult.from_dict(document), name, **options)


def joints_of(document, rank, hand, part="joints"):
    return [document["grasps"][rank - 1][part][name] for name in hand.joint_names]


def pose_of(grasp):
    return pose_matrix(rotation_from_wxyz(grasp["palm"]["wxyz"]), grasp["palm"]["position"])


def test_isaac_grasp_round_trip(document, barrett):
    file = read_isaac_grasp(yaml.safe_load(export(document, "isaac_grasp")))
    assert (file.object_frame, file.gripper_frame, len(file.grasps)) == ("mug", "palm", 2)
    for read, grasp in zip(file.grasps, document["grasps"], strict=False):
        np.testing.assert_allclose(read.object_from_gripper, pose_of(grasp), atol=1e-12)
        assert read.joints == grasp["joints"]
        assert read.pregrasp_joints == grasp["pregrasp"]["joints"]
    assert [read.confidence for read in file.grasps] == pytest.approx([1.0, 2 / 3])


def test_dexgraspbench_round_trip(document, barrett):
    best = document["grasps"][0]
    sample = read_dexgraspbench(load_npy(export(document, "dexgraspbench")))
    pose = [*best["palm"]["position"], *best["palm"]["wxyz"]]
    np.testing.assert_allclose(sample.grasp, [*pose, *joints_of(document, 1, barrett)])
    np.testing.assert_allclose(sample.squeeze, [*pose, *joints_of(document, 1, barrett, "squeeze_joints")])
    opened = [best["pregrasp"]["joints"][name] for name in barrett.joint_names]
    np.testing.assert_allclose(sample.pregrasp, [*pose, *opened])
    assert sample.approach is not None
    np.testing.assert_allclose(sample.approach[0, :3], best["pregrasp"]["palm"]["position"])
    np.testing.assert_array_equal(sample.approach[-1], sample.pregrasp)
    np.testing.assert_array_equal(sample.object_pose, [0, 0, 0, 1, 0, 0, 0])
    assert (sample.object_scale, sample.object_path, sample.joint_names) == (1.0, "mug", barrett.joint_names)
    second = read_dexgraspbench(load_npy(export(document, "dexgraspbench", rank=2)))
    np.testing.assert_allclose(second.grasp[:3], document["grasps"][1]["palm"]["position"])


def test_moveit_carries_the_whole_execution_that_was_planned(barrett, prepared):
    asked = Constraints(
        Scene(
            "cell",
            support_surfaces=(
                SupportSurface("tray", allow_finger_contact=True),
                SupportSurface("wall", (0, 1, 0), -0.5),
            ),
        ),
        Approach(
            desired_distance=0.08,
            min_distance=0.04,
            retreat=Retreat(frame="cell", desired_distance=0.09, min_distance=0.05),
        ),
    )
    result = plan(prepared("box"), barrett, starts=12, seed=1, top_k=2, constraints=asked)
    assert result.feasible > 0
    grasps = json.loads(export_result(result, "moveit"))["grasps"]
    for message, grasp in zip(grasps, result.grasps, strict=False):
        object_from_palm = pose_of({"palm": {"position": grasp.palm.position, "wxyz": grasp.palm.wxyz}})
        pregrasp, way_in, way_out = (
            grasp.pregrasp_pose(barrett),
            message["pre_grasp_approach"],
            message["post_grasp_retreat"],
        )
        assert way_in["direction"]["header"]["frame_id"] == barrett.palm
        backwards = way_in["desired_distance"] * np.array([*way_in["direction"]["vector"].values()])
        begin = object_from_palm[:3, 3] - object_from_palm[:3, :3] @ backwards
        np.testing.assert_allclose(begin, pregrasp.position, atol=1e-9)
        np.testing.assert_allclose(message["pre_grasp_posture"]["points"][0]["positions"], pregrasp.joints, atol=1e-9)
        squeeze = [grasp.squeeze_joints[name] for name in barrett.joint_names]
        np.testing.assert_allclose(message["grasp_posture"]["points"][0]["positions"], squeeze, atol=1e-9)
        assert 0.04 == way_in["min_distance"] <= way_in["desired_distance"] <= 0.08 + 1e-9
        assert way_out["direction"]["header"]["frame_id"] == "cell"
        np.testing.assert_allclose([*way_out["direction"]["vector"].values()], (0, 0, 1), atol=1e-9)
        assert 0.05 == way_out["min_distance"] <= way_out["desired_distance"] <= 0.09 + 1e-9
        assert message["allowed_touch_objects"] == ["box", "tray"]


def test_dexgraspbench_sample_opens_as_its_users_open_it(document, tmp_path):
    (tmp_path / "sample.npy").write_bytes(export(document, "dexgraspbench"))
    sample = np.load(tmp_path / "sample.npy", allow_pickle=True).item()
    assert sample["grasp_qpos"].shape == (15,)
    assert sample["approach_qpos"].shape == (2, 15)


def test_moveit_says_the_same_in_both_notations(document, barrett):
    read = json.loads(export(document, "moveit"))
    assert yaml.safe_load(export(document, "moveit_yaml")) == read
    assert len(read["grasps"]) == 2
    for message, grasp in zip(read["grasps"], document["grasps"], strict=False):
        pose = message["grasp_pose"]["pose"]
        assert message["grasp_pose"]["header"]["frame_id"] == "mug"
        assert [pose["position"][k] for k in "xyz"] == grasp["palm"]["position"]
        assert [pose["orientation"][k] for k in "wxyz"] == pytest.approx(grasp["palm"]["wxyz"], abs=1e-15)
        posture = message["grasp_posture"]
        assert posture["joint_names"] == list(barrett.joint_names)
        assert posture["points"][0]["positions"] == list(grasp["squeeze_joints"].values())
        assert message["pre_grasp_posture"]["points"][0]["positions"] == list(grasp["pregrasp"]["joints"].values())
        approach = message["pre_grasp_approach"]
        assert approach["desired_distance"] == pytest.approx(0.1)
        assert [approach["direction"]["vector"][k] for k in "xyz"] == pytest.approx([0, 0, 1], abs=1e-9)
        assert approach["direction"]["header"]["frame_id"] == "palm"
        assert message["allowed_touch_objects"] == ["mug"]


def test_multi_gripper_grasp(document, barrett):
    read = json.loads(export(document, "multi_gripper_grasp"))
    assert (read["gripper"], read["object_ID"]) == ("barrett", "mug")
    for row, (pose, dofs) in enumerate(zip(read["pose"], read["dofs"], strict=True)):
        grasp = document["grasps"][row]
        assert pose == pytest.approx([*grasp["palm"]["position"], *grasp["palm"]["wxyz"]], abs=1e-15)
        assert dofs == joints_of(document, row + 1, barrett)


def test_dexgraspnet_pose_by_euler_angles(document):
    rows = load_npy(export(document, "dexgraspnet"))
    assert len(rows) == 2
    for row, grasp in zip(rows, document["grasps"], strict=False):
        angles = [row["qpos"][f"WRJR{k}"] for k in "xyz"]
        turns = [Rotation.from_rotvec(angle * axis).as_matrix() for angle, axis in zip(angles, np.eye(3), strict=True)]
        np.testing.assert_allclose(turns[2] @ turns[1] @ turns[0], pose_of(grasp)[:3, :3], atol=1e-9)
        assert [row["qpos"][f"WRJT{k}"] for k in "xyz"] == grasp["palm"]["position"]
        assert {name: row["qpos"][name] for name in grasp["joints"]} == grasp["joints"]
        assert row["scale"] == 1.0


def provenance(name, data):
    if name == "dexgraspbench":
        return load_npy(data)["fingersplit"]
    if name == "dexgraspnet":
        return load_npy(data)[0]["fingersplit"]
    return yaml.safe_load(data)["fingersplit"]


@pytest.mark.parametrize("name", EXPORT_FORMATS)
def test_every_format_names_hand_hash_and_frames(document, name, barrett):
    said = provenance(name, export(document, name))
    assert said["hand"] == "barrett"
    assert said["hand_description_sha256"] == document["provenance"]["hand_sha256"]
    assert len(said["hand_description_sha256"]) == 64
    assert (said["hand_frame"], said["object"], said["object_id"]) == ("palm", "mug", "0123abcd")
    assert said["joint_names"] == list(barrett.joint_names)


@pytest.mark.parametrize("name", EXPORT_FORMATS)
def test_every_format_says_how_each_grasp_is_executed_and_how_good_it_is(document, name):
    said = provenance(name, export(document, name))
    count = 1 if formats_that("write")[name].one_grasp else 2
    assert len(said["grasps"]) == count
    for one, grasp in zip(said["grasps"], document["grasps"], strict=False):
        assert one["rank"] == grasp["rank"]
        assert one["metrics"] == grasp["metrics"]
        assert one["squeeze_joints"] == grasp["squeeze_joints"]
        assert one["pregrasp"]["joints"] == grasp["pregrasp"]["joints"]
        assert one["pregrasp"]["palm"]["position"] == grasp["pregrasp"]["palm"]["position"]
        assert one["approach"]["distance"] == pytest.approx(0.1)
        assert one["approach"]["direction_in_hand_frame"] == pytest.approx([0, 0, 1], abs=1e-9)
    qualities = [one["quality"] for one in said["grasps"]]
    assert qualities == sorted(qualities, reverse=True)
    assert qualities[0] == 1.0
    left_out = {one["rank"]: one["reason"] for one in said["left_out"]}
    assert left_out.keys() == ({2, 3} if count == 1 else {3})
    assert left_out[3].startswith("not feasible")


def test_tool_frame_stands_where_the_jaws_meet(document, barrett):
    tool = provenance("moveit", export(document, "moveit"))["tool"]["hand_from_tool"]
    rotation = rotation_from_wxyz(tool["wxyz"])
    np.testing.assert_allclose(rotation, barrett.gripper.palm_from_gripper, atol=1e-12)
    low, high = barrett.gripper.standoff
    along = rotation[:, 2] @ tool["position"]
    assert low <= along <= high


def test_quality_falls_with_the_rank_whatever_the_metrics_say(document):
    """The better Ferrari-Canny number is the one of rank 2."""
    metrics = [grasp["metrics"]["ferrari_canny"] for grasp in document["grasps"]]
    assert metrics[0] < metrics[1]
    qualities = [message["grasp_quality"] for message in json.loads(export(document, "moveit"))["grasps"]]
    assert 1.0 >= qualities[0] > qualities[1] > 0.0


@pytest.mark.parametrize("name", EXPORT_FORMATS)
def test_grasps_without_a_way_in_stay_behind_and_the_file_says_so(document, name):
    document["grasps"][0]["pregrasp"] = None
    file = export_file(PlanResult.from_dict(document), name)
    said = provenance(name, file.content)
    assert [grasp["rank"] for grasp in said["grasps"]] == [2]
    assert {"rank": 1, "reason": said["left_out"][0]["reason"]} in said["left_out"]
    assert "no collision-free straight way in" in said["left_out"][0]["reason"]
    assert "rank 1: no collision-free" in file.message
    assert export(document, name, rank=1), "asked for by its rank it goes out all the same"
    document["grasps"][1]["pregrasp"] = None
    with pytest.raises(FormatError, match="no grasp that can be executed: rank 1: no collision-free"):
        export(document, name)


def test_infeasible_grasps_go_out_only_when_asked_for(document):
    assert len(json.loads(export(document, "moveit", rank=3))["grasps"]) == 1
    with pytest.raises(ResultError, match="has 3 grasps and none of rank 9"):
        export(document, "moveit", rank=9)
    document["grasps"] = document["grasps"][2:]
    with pytest.raises(FormatError, match="holds no grasp that can be executed: rank 3: not feasible"):
        export(document, "moveit")


def test_unknown_formats_and_joints_are_refused(document):
    with pytest.raises(FormatError, match="Unknown format 'csv'; known: curobo, dexgraspbench, dexgraspnet, "):
        export(document, "csv")
    with pytest.raises(FormatError, match="Unknown format 'acronym'"):  # which is only read
        export(document, "acronym")
    del document["grasps"][0]["joints"]["finger1_spread"]
    with pytest.raises(ResultError, match="finger1_spread"):
        export(document, "moveit")


class Runs:
    def __reduce__(self):
        return print, ("this must not be printed",)


def test_pickles_run_nothing(capsys):
    with pytest.raises(FormatError, match=r"asks for builtins.print to be run"):
        load_npy(dump_npy({"grasp_qpos": Runs()}))
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_arrays_of_any_age_are_read(protocol):
    value = {"a": np.arange(3.0), "b": np.float64(2.5), "c": "text", "d": [1, (2, None)]}
    header = dump_npy(value)
    start = header.index(b"\n") + 1
    array = np.empty((), dtype=object)
    array[()] = value
    read = load_npy(header[:start] + pickle.dumps(array, protocol=protocol))
    np.testing.assert_array_equal(read["a"], value["a"])
    assert (read["b"], read["c"], read["d"]) == (2.5, "text", [1, (2, None)])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"grasp_qpos": np.zeros(5)}, "grasp_qpos of the DexGraspBench sample needs at least 7 numbers, got 5"),
        (
            {"squeeze_qpos": np.zeros(9)},
            r"squeeze_qpos of the DexGraspBench sample has the shape \(9,\); it must be 10",
        ),
        ({"obj_pose": "here"}, "obj_pose of the DexGraspBench sample must be numbers"),
        ({"grasp_qpos": np.full(10, np.nan)}, "not finite"),
    ],
)
def test_damaged_dexgraspbench_samples_are_refused(change, message):
    sample = {"obj_pose": np.zeros(7), "obj_scale": 1.0, "obj_path": "x", "grasp_qpos": np.zeros(10)}
    assert read_dexgraspbench(sample).joint_names is None
    with pytest.raises(FormatError, match=message):
        read_dexgraspbench({**sample, **change})
    del sample["obj_path"]
    with pytest.raises(FormatError, match="has no 'obj_path'"):
        read_dexgraspbench(sample)


def test_bytes_that_are_no_npy_are_refused():
    whole = dump_npy({"a": np.arange(4.0)})
    for broken in (b"", b"\x93NUMPY", whole[:40], whole[:-5], b"PK" + whole):
        with pytest.raises(FormatError):
            load_npy(broken)
    with pytest.raises(FormatError, match="is a dict, this file holds"):
        read_dexgraspbench([{"a": 1}])


def test_curobo_poses_and_offsets_lead_to_the_grasp(template):
    """The tool's pose and the approach offset are those of the result, in the scene's frame."""
    goals, result = json.loads(export(template, "curobo")), PlanResult.from_dict(template)
    exported = [result.grasp(entry["rank"]) for entry in goals["fingersplit"]["grasps"]]
    assert len(goals["grasp_poses"]["position"]) == len(exported) > 0
    for n, grasp in enumerate(exported):
        assert goals["grasp_poses"]["position"][n] == list(grasp.world.tool.position)
        assert goals["grasp_poses"]["quaternion_wxyz"][n] == list(grasp.world.tool.wxyz)
        rotation = rotation_from_wxyz(goals["grasp_poses"]["quaternion_wxyz"][n])
        start = grasp.world.tool.position + rotation @ goals["grasp_approach_offset"]["position"][n]
        np.testing.assert_allclose(start, grasp.world.pregrasp_tool.position, atol=1e-9)
        lift = np.linalg.norm(goals["retract_offset"]["position"][n])
        assert lift == pytest.approx(grasp.retreat_path.distance)
        assert goals["grasp_joints"][n] == [grasp.joints[name] for name in goals["joint_names"]]
