"""Hands are data: an MJCF with other finger and joint counts is read, moved and planned for by the same code."""

from pathlib import Path

import numpy as np
import pytest

from fingersplit.hands import Finger, Gripper, Hand
from fingersplit.hands.mjcf import read_mjcf
from fingersplit.planning.planning import plan

FINGERS = ("thumb", "first", "second", "third")
COUNTS = (2, 3, 4, 2)
MOUNTS = (("0 -0.05 0.01", -90), ("0.016 0.05 0.01", 90), ("0 0.05 0.01", 90), ("-0.016 0.05 0.01", 90))


def finger_mjcf(name: str, count: int, mount: str, turn: int, joint_offset: str) -> str:
    """A chain of 90 mm that stands up from the palm and closes with positive angles."""
    length = 0.09 / count
    chain = f'<site name="{name}_pad" pos="{length} 0 0" size="0.006" zaxis="0.3 0 1"/>'
    for number in reversed(range(count)):
        place = f'pos="{length} 0 0"' if number else 'axisangle="0 -1 0 80"'
        chain = (
            f'<body name="{name}_{number}" {place}>'
            f'<joint name="{name}_{number}" axis="0 -1 0" range="-30 60" pos="{joint_offset}"/>'
            f'<geom name="{name}_{number}" type="capsule" fromto="0 0 0 {length} 0 0" size="0.006"/>{chain}</body>'
        )
    return f'<body pos="{mount}" axisangle="0 0 1 {turn}">{chain}</body>'


def hand_mjcf(counts: tuple[int, ...] = COUNTS, joint_offset: str = "0 0 0") -> str:
    fingers = "".join(
        finger_mjcf(name, count, *mount, joint_offset)
        for name, count, mount in zip(FINGERS, counts, MOUNTS, strict=True)
    )
    return (
        '<mujoco><compiler angle="degree" autolimits="true"/><worldbody><body name="palm" pos="0.2 0 0.1">'
        f'<geom name="plate" type="box" size="0.055 0.06 0.01"/>{fingers}</body></worldbody></mujoco>'
    )


def read_hand(folder: Path, mjcf: str) -> Hand:
    path = folder / "hand.xml"
    path.write_text(mjcf)
    model = read_mjcf(path, "palm", FINGERS)
    arrays, names = model.arrays, model.joint_names
    fingers = tuple(
        Finger(name, tuple(names[j] for j in indices[:count]), float(radius))
        for name, count, indices, radius in zip(
            FINGERS, arrays.joint_counts, arrays.joint_indices, arrays.pad_radii, strict=False
        )
    )
    gripper = Gripper(
        groups=np.array([1, 0, 0, 0]),
        palm_from_gripper=np.column_stack([(1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)]),
        center=np.zeros(2),
        standoff=(0.05, 0.11),
        opening=(0.0, 0.12),
        preshapes=np.full((1, len(names)), 0.1),
    )
    limits = np.full(len(names), 0.5)
    return Hand("own", "Four fingers", names, model.shape_names, fingers, gripper, limits, arrays, path, "palm")


@pytest.mark.parametrize("joint_offset", ["0 0 0", "0.004 -0.002 0.003"])
def test_any_chain_moves_as_in_mujoco(tmp_path, mujoco_hand, joint_offset):
    hand = read_hand(tmp_path, hand_mjcf(joint_offset=joint_offset))
    assert hand.arrays.joint_counts.tolist() == [*COUNTS, 0]
    reference = mujoco_hand(tmp_path / "hand.xml")
    rng = np.random.default_rng(3)
    for _ in range(10):
        joints = rng.uniform(hand.lower, hand.upper)
        reference.move(dict(zip(hand.joint_names, joints, strict=True)))
        palm_rotation, palm_position = reference.body("palm")
        object_from_palm = np.eye(4)
        object_from_palm[:3, :3], object_from_palm[:3, 3] = palm_rotation, palm_position
        pose = hand.pose(joints, object_from_palm)
        for f, finger in enumerate(FINGERS):
            position, normal = reference.site(f"{finger}_pad")
            np.testing.assert_allclose(pose.pads[f], position, atol=1e-12)
            np.testing.assert_allclose(pose.pad_normals[f], normal, atol=1e-12)
        for name, vertices, _ in hand.posed_meshes(joints):
            assert np.abs(reference.geom_distance(name, vertices + palm_position)).max() < 1e-9


def test_jacobian_of_an_offset_joint_agrees_with_finite_differences(tmp_path):
    hand = read_hand(tmp_path, hand_mjcf(joint_offset="0.004 -0.002 0.003"))
    joints, step = np.full(len(hand.joint_names), 0.2), 1e-6
    pose = hand.pose(joints)
    for f, indices in enumerate(hand.arrays.joint_indices[: len(FINGERS)]):
        for column, j in enumerate(indices[: COUNTS[f]]):
            turn = step * np.eye(len(joints))[j]
            slope = (hand.pose(joints + turn).pads[f] - hand.pose(joints - turn).pads[f]) / (2 * step)
            np.testing.assert_allclose(pose.jacobians[f, :, column], slope, atol=1e-8)


def test_finger_of_five_joints_is_refused(tmp_path):
    with pytest.raises(ValueError, match="second has more than 4 joints"):
        read_hand(tmp_path, hand_mjcf(counts=(2, 3, 5, 2)))


def test_finger_that_hangs_elsewhere_is_refused(tmp_path):
    stray = '<body name="elsewhere"><geom size="0.01"/><site name="thumb_pad" size="0.006"/></body></worldbody>'
    mjcf = hand_mjcf().replace("thumb_pad", "old_pad").replace("</worldbody>", stray)
    with pytest.raises(ValueError, match="'elsewhere' does not hang below the palm"):
        read_hand(tmp_path, mjcf)


def test_geom_beside_the_chains_is_refused(tmp_path):
    mjcf = hand_mjcf().replace("</worldbody>", '<geom name="table" type="box" size="1 1 0.01"/></worldbody>')
    with pytest.raises(ValueError, match="'table' hangs on no finger's chain and not on the palm"):
        read_hand(tmp_path, mjcf)


def test_joint_that_slides_is_refused(tmp_path):
    mjcf = hand_mjcf().replace('<joint name="thumb_1" axis', '<joint name="thumb_1" type="slide" axis')
    with pytest.raises(ValueError, match="thumb_1 must have one joint, a hinge"):
        read_hand(tmp_path, mjcf)


def test_hand_too_large_for_the_kernels_is_refused_by_number(tmp_path):
    (tmp_path / "hand.xml").write_text(hand_mjcf())
    with pytest.raises(ValueError, match="6 fingers; the kernels are built for 5"):
        read_mjcf(tmp_path / "hand.xml", "palm", (*FINGERS, "fourth", "fifth"))
    plates = "".join(f'<geom name="extra{k}" size="0.01"/>' for k in range(30))
    with pytest.raises(ValueError, match="geoms; the kernels are built for 32"):
        read_hand(tmp_path, hand_mjcf().replace('<geom name="plate"', f'{plates}<geom name="plate"'))
    long = '<geom name="plate" type="box" size="0.4 0.4 0.01"/>'
    wide = hand_mjcf().replace('<geom name="plate" type="box" size="0.055 0.06 0.01"/>', long)
    with pytest.raises(ValueError, match="its shapes need more than the 96 spheres"):
        read_hand(tmp_path, wide)


def test_torque_limits_stand_with_their_fingers(tmp_path, barrett):
    hand = read_hand(tmp_path, hand_mjcf())
    for finger, count, limits in zip(FINGERS, COUNTS, hand.finger_torque_limits, strict=True):
        assert (limits[:count] == 0.5).all(), finger
        assert (limits[count:] == np.inf).all(), finger
    named = dict(zip(barrett.joint_names, barrett.torque_limits, strict=True))
    for finger, limits in zip(barrett.fingers, barrett.finger_torque_limits, strict=True):
        assert [named[joint] for joint in finger.joint_names] == limits[: len(finger.joint_names)].tolist()


def test_four_fingers_are_planned_for(tmp_path, prepared):
    hand = read_hand(tmp_path, hand_mjcf())
    planned = plan(prepared("sphere"), hand, starts=16, seed=1)
    assert planned.feasible > 0
    document = planned.to_document()["grasps"][0]
    assert [contact["finger"] for contact in document["contacts"]] == list(FINGERS)
    assert set(document["joints"]) == set(hand.joint_names)
    run = planned.grasps[0].run
    np.testing.assert_allclose(np.linalg.norm(run.final.contacts, axis=1), 0.035, atol=0.3e-3)
    pads = hand.pose(run.final.joints, run.final.object_from_palm).pads[: len(FINGERS)]
    np.testing.assert_allclose(np.linalg.norm(pads, axis=1), 0.035 + 0.006, atol=0.6e-3)
