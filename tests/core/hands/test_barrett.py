"""The Barrett hand against published numbers."""

import dataclasses

import numpy as np
import pytest

from fingersplit.errors import UnknownHandError
from fingersplit.hands import available_hands, load_hand

DEGREE = np.pi / 180

# Farthest point of a finger in the palm frame at (spread, proximal, distal), from the CAD model [Robotnik].
CHECK_POINTS = [
    ("finger3", (0, 0, 0), (0.0, -167.6, 113.3)),
    ("finger3", (0, 90, 0), (0.0, -12.1, 193.0)),
    ("finger3", (0, 90, 30), (0.0, 7.1, 169.2)),
    ("finger1", (90, 60, 20), (81.3, 0.0, 190.5)),
]

# Of the CAD model [herb_description], in grams.
MASSES = {"palm": 608.6, "knuckle": 141.09, "proximal": 62.14, "distal": 41.66}


@pytest.mark.parametrize(("finger", "degrees", "millimetres"), CHECK_POINTS)
def test_finger_ends_where_the_cad_model_has_it(mujoco_barrett, finger, degrees, millimetres):
    angles = zip(("spread", "proximal", "distal"), np.multiply(DEGREE, degrees), strict=True)
    known = {mujoco_barrett.model.joint(j).name for j in range(mujoco_barrett.model.njnt)}
    joints = dict.fromkeys(known, 0.0)
    joints |= {f"{finger}_{joint}": angle for joint, angle in angles if f"{finger}_{joint}" in known}
    mujoco_barrett.move(joints)
    np.testing.assert_allclose(1e3 * mujoco_barrett.site(f"{finger}_end")[0], millimetres, atol=0.15)


def test_joint_ranges_are_those_of_the_manual(barrett):
    ranges = {"spread": 180, "proximal": 140, "distal": 48}
    assert len(barrett.joint_names) == 8
    for name, low, high in zip(barrett.joint_names, barrett.lower, barrett.upper, strict=True):
        assert low == 0.0
        assert high == pytest.approx(ranges[name.split("_")[1]] * DEGREE)


def test_links_weigh_what_is_published(mujoco_barrett):
    model = mujoco_barrett.model
    for body in range(1, model.nbody):
        kind = model.body(body).name.split("_")[-1]
        assert 1e3 * model.body_mass[body] == pytest.approx(MASSES[kind], abs=0.01), model.body(body).name


@pytest.mark.parametrize("spread", [0.0, 0.4, 1.5, np.pi])
def test_finger2_mirrors_finger1(barrett, spread):
    joints = np.zeros(8)
    for finger in ("finger1", "finger2"):
        for joint, angle in (("spread", spread), ("proximal", 0.9), ("distal", 0.3)):
            joints[barrett.joint_names.index(f"{finger}_{joint}")] = angle
    pose = barrett.pose(joints)
    mirror = np.array([-1, 1, 1])
    np.testing.assert_allclose(pose.pads[1], mirror * pose.pads[0], atol=1e-12)
    np.testing.assert_allclose(pose.pad_normals[1], mirror * pose.pad_normals[0], atol=1e-12)


def test_spread_zero_opposes_finger3_and_half_a_turn_joins_it(barrett):
    opened, joined = np.full(8, 0.5), np.full(8, 0.5)
    spreads = [barrett.joint_names.index(f"finger{k}_spread") for k in (1, 2)]
    opened[spreads], joined[spreads] = 0.0, np.pi
    assert (barrett.pose(opened).pads[:3, 1] > 0).tolist() == [True, True, False]
    assert (barrett.pose(joined).pads[:3, 1] > 0).tolist() == [False, False, False]


def test_fingers_and_joints_are_named(barrett):
    assert "barrett" in available_hands()
    assert [finger.name for finger in barrett.fingers] == ["finger1", "finger2", "finger3"]
    assert [len(finger.joint_names) for finger in barrett.fingers] == [3, 3, 2]
    assert barrett.fingers[2].joint_names == ("finger3_proximal", "finger3_distal")
    assert [finger.pad_radius for finger in barrett.fingers] == [0.00725] * 3
    document = barrett.to_document()
    assert [joint["name"] for joint in document["joints"]] == list(barrett.joint_names)
    assert [finger["joints"] for finger in document["fingers"]] == [list(f.joint_names) for f in barrett.fingers]


def test_unknown_hand_names_the_known():
    with pytest.raises(UnknownHandError, match="known hands: allegro, barrett, barrett_coupled, three_finger"):
        load_hand("claw")


def test_hand_is_loaded_once_and_cannot_be_changed(barrett):
    assert load_hand("barrett") is barrett
    for field in barrett.arrays.dtype.names:
        with pytest.raises(ValueError, match="read-only"):
            barrett.arrays[field] = 0
    for array in (barrett.lower, barrett.upper, barrett.torque_limits):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        barrett.name = "other"


def test_gripper_frame_is_right_handed_and_groups_oppose(barrett):
    np.testing.assert_allclose(np.linalg.det(barrett.gripper.palm_from_gripper), 1.0)
    np.testing.assert_array_equal(barrett.gripper.palm_from_gripper[:, 2], [0, 0, 1])
    assert barrett.gripper.groups.tolist() == [0, 0, 1]
    for preshape in barrett.gripper.preshapes:
        assert (barrett.lower <= preshape).all()
        assert (preshape <= barrett.upper).all()
        along_jaw = barrett.pose(preshape).pads[:3] @ barrett.gripper.palm_from_gripper[:, 1]
        assert along_jaw[:2].min() > 0 > along_jaw[2]


@pytest.mark.parametrize("joint", ["proximal", "distal"])
def test_torque_limits_are_a_fingertip_force_of_15_newtons(barrett, joint):
    """Where the pad is farthest from the joint, a force across the lever costs the joint its limit."""
    j = ["proximal", "distal"].index(joint)
    levers = [np.linalg.norm(barrett.pose(np.full(8, distal)).jacobians[2, :, j]) for distal in np.linspace(0, 0.8, 9)]
    limit = barrett.torque_limits[barrett.joint_names.index(f"finger3_{joint}")]
    assert limit / max(levers) == pytest.approx(15, rel=0.04)
