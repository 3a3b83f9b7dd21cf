"""Hands are data: a model with other finger and joint counts is read, moved and planned for by the same code."""

import re
from typing import Any

import mujoco
import numpy as np
import pytest

from fingersplit.errors import HandError
from fingersplit.hands import Hand, load_hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.recording.replay import replay
from fingersplit.verification import verify_ranked
from own_hand import COUNTS, FINGERS, description, hand_mjcf, write_hand


@pytest.fixture
def own_hand(tmp_path):
    def build(mjcf: str, described: dict[str, Any] | None = None) -> Hand:
        return load_hand(write_hand(tmp_path / "own", mjcf, described or description()))

    return build


ACTIVE = ("first", "second", "third", "thumb")


@pytest.mark.parametrize("joint_offset", ["0 0 0", "0.004 -0.002 0.003"])
@pytest.mark.parametrize("extra", ["", 'ref="20"'])
def test_any_chain_moves_as_in_mujoco(tmp_path, own_hand, mujoco_hand, joint_offset, extra):
    hand = own_hand(hand_mjcf(joint_offset=joint_offset, extra=extra))
    counts = dict(zip(FINGERS, COUNTS, strict=True))
    assert hand.arrays.joint_counts[:5].tolist() == [*(counts[name] for name in ACTIVE), 0]
    reference = mujoco_hand(tmp_path / "own" / "hand.xml")
    rng = np.random.default_rng(3)
    for _ in range(10):
        joints = rng.uniform(hand.lower, hand.upper)
        reference.move(dict(zip(hand.joint_names, joints, strict=True)))
        palm_rotation, palm_position = reference.body("palm")
        object_from_palm = np.eye(4)
        object_from_palm[:3, :3], object_from_palm[:3, 3] = palm_rotation, palm_position
        pose = hand.pose(joints, object_from_palm)
        for f, finger in enumerate(ACTIVE):
            position, normal = reference.site(f"{finger}_pad")
            np.testing.assert_allclose(pose.pads[f], position, atol=1e-12)
            np.testing.assert_allclose(pose.pad_normals[f], normal, atol=1e-12)
        for name, vertices, _ in hand.posed_meshes(joints):
            assert np.abs(reference.geom_distance(name, vertices + palm_position)).max() < 1e-9


def test_jacobian_of_an_offset_joint_agrees_with_finite_differences(own_hand):
    hand = own_hand(hand_mjcf(joint_offset="0.004 -0.002 0.003"))
    joints, step = np.full(len(hand.joint_names), 0.2), 1e-6
    pose = hand.pose(joints)
    for f, finger in enumerate(hand.fingers):
        for column, name in enumerate(finger.joint_names):
            turn = step * np.eye(len(joints))[hand.joint_names.index(name)]
            slope = (hand.pose(joints + turn).pads[f] - hand.pose(joints - turn).pads[f]) / (2 * step)
            np.testing.assert_allclose(pose.jacobians[f, :, column], slope, atol=1e-8)


def test_the_simulated_hand_stands_where_the_model_does(own_hand):
    hand = own_hand(hand_mjcf(joint_offset="0.004 -0.002 0.003", extra='ref="20"'))
    model = hand.spec().compile()
    data = mujoco.MjData(model)
    joints = np.random.default_rng(4).uniform(hand.lower, hand.upper)
    for name, angle in zip(hand.joint_names, joints, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_kinematics(model, data)
    for name, palm_from_shape in zip(hand.shape_names, hand.shape_poses(joints), strict=True):
        np.testing.assert_allclose(data.geom(name).xpos, palm_from_shape[:3, 3], atol=1e-12)


def test_finger_that_is_not_active_is_parked(own_hand):
    described = description()
    described["grips"][0] |= {"jaws": [["first", "third"], ["thumb"]], "parked": {"second_0": -0.4}}
    hand = own_hand(hand_mjcf(), described)
    assert [finger.name for finger in hand.fingers] == ["first", "third", "thumb"]
    assert hand.parked_links == ("second_0", "second_1", "second_2", "second_3")
    parked = [hand.joint_names.index(f"second_{j}") for j in range(4)]
    np.testing.assert_array_equal(hand.lower[parked], [-0.4, 0, 0, 0])
    np.testing.assert_array_equal(hand.upper[parked], [-0.4, 0, 0, 0])
    np.testing.assert_array_equal(hand.gripper.preshapes[0][parked], [-0.4, 0, 0, 0])
    whole = own_hand(hand_mjcf())
    np.testing.assert_array_equal(hand.arrays.coupling[parked], 0)
    joints = np.where(hand.lower == hand.upper, hand.lower, 0.3)
    for one, other in zip(hand.shape_poses(joints), whole.shape_poses(joints), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_every_set_of_fingers_is_the_same_hand(own_hand):
    described = description()
    described["grips"].append(described["grips"][0] | {"jaws": [["thumb"], ["first", "second"]]})
    hand = own_hand(hand_mjcf(), described)
    assert hand.grips[0] is hand
    assert [[finger.name for finger in grip.fingers] for grip in hand.grips] == [
        list(ACTIVE),
        ["thumb", "first", "second"],
    ]
    assert hand.grips[1].gripper.groups.tolist() == [0, 1, 1]
    assert hand.grips[1].grips == hand.grips


def test_torque_limits_are_those_of_the_active_drivers(own_hand, barrett):
    hand = own_hand(hand_mjcf())
    assert (hand.torque_limits == 0.5).all()
    assert len(hand.torque_limits) == hand.arrays.driver_count == len(hand.driver_names)
    assert barrett.driver_names == barrett.joint_names


def test_four_fingers_are_planned_for(own_hand, prepared):
    hand = own_hand(hand_mjcf())
    planned = plan(prepared("sphere"), hand, starts=16, seed=1)
    assert planned.feasible > 0
    best = planned.grasps[0]
    assert [contact.finger for contact in best.contacts] == list(ACTIVE)
    assert set(best.joints) == set(hand.joint_names)
    grasp = best.for_hand(hand)
    np.testing.assert_allclose(np.linalg.norm(grasp.contacts, axis=1), 0.035, atol=0.3e-3)
    pads = hand.pose(grasp.joints, grasp.object_from_palm).pads[: len(FINGERS)]
    np.testing.assert_allclose(np.linalg.norm(pads, axis=1), 0.035 + 0.006, atol=0.6e-3)


def test_three_fingers_hold_while_the_fourth_is_parked(own_hand, prepared):
    described = description()
    described["grips"][0] |= {"jaws": [["first", "third"], ["thumb"]], "parked": {"second_0": -0.4}}
    hand = own_hand(hand_mjcf(), described)
    planned = plan(prepared("sphere"), hand, starts=16, seed=1)
    assert planned.feasible > 0
    best = planned.to_dict()["grasps"][0]
    assert [contact["finger"] for contact in best["contacts"]] == ["first", "third", "thumb"]
    assert best["joints"]["second_0"] == -0.4
    assert {best["joints"][f"second_{j}"] for j in (1, 2, 3)} == {0.0}


MANY = description()
WIDE = hand_mjcf().replace('size="0.055 0.06 0.01"', 'size="0.4 0.4 0.01"')
SLIDING = hand_mjcf().replace('<joint name="thumb_1" axis', '<joint name="thumb_1" type="slide" axis')
UNLIMITED = hand_mjcf().replace('name="thumb_1" axis="0 -1 0" range="-30 60"', 'name="thumb_1" axis="0 -1 0"')
STRAY = (
    hand_mjcf()
    .replace("thumb_pad", "old_pad")
    .replace(
        "</worldbody>",
        '<body name="elsewhere"><geom size="0.01"/><site name="thumb_pad" size="0.006"/></body></worldbody>',
    )
)
LONG = hand_mjcf(counts=(2, 3, 7, 2))
SPRUNG = hand_mjcf(after='<actuator><position joint="thumb_0"/></actuator>').replace(
    '<joint name="thumb_1"', '<joint name="thumb_1" stiffness="1"'
)
LOOP = hand_mjcf(
    after='<equality><connect body1="thumb_1" body2="first_2" anchor="0 0 0"/></equality>',
)
CURVED = hand_mjcf(after='<equality><joint joint1="thumb_1" joint2="thumb_0" polycoef="0 1 4 0 0"/></equality>')
CIRCLE = hand_mjcf(
    after='<equality><joint joint1="thumb_1" joint2="thumb_0"/><joint joint1="thumb_0" joint2="thumb_1"/></equality>'
)
NO_TORQUE = description() | {"torque_limits": {}}


def without(*names: str) -> dict[str, Any]:
    described = description()
    for name in names:
        del described["torque_limits"][name], described["grips"][0]["preshapes"][0][name]
    return described


def with_grip(**changes: Any) -> dict[str, Any]:
    described = description()
    described["grips"][0] |= changes
    return described


@pytest.mark.parametrize(
    ("mjcf", "described", "said"),
    [
        (
            hand_mjcf(),
            description() | {"palm": "hand"},
            "no body 'hand' for the palm; its bodies: world, palm, thumb_mount",
        ),
        (hand_mjcf(), description() | {"colour": "red"}, r"hand\.toml: colour: There is no such field"),
        (hand_mjcf(), description() | {"fixed": {"thumb_9": 0.0}}, r"\[fixed\] names the joint 'thumb_9'"),
        (LONG, description((2, 3, 7, 2)), "'second' has 7 joints; fingers of up to 6"),
        (STRAY, description(), "Site 'thumb_pad' of 'thumb' does not hang below the palm"),
        (SLIDING, description(), r"'thumb_1' is no hinge, but slides"),
        (
            hand_mjcf().replace('"0 -0.05 0.01"', '"0 -50 10"'),
            description(),
            r"'thumb_mount' is 50.* m from the palm.* in millimetres\?",
        ),
        (hand_mjcf().replace("0.055 0.06 0.01", "55 60 10"), description(), "'plate' of 'palm' reaches 60 m"),
        (hand_mjcf().replace('"degree"', '"radian"'), description(), r"limits -30 to 60 rad, .* in degrees\?"),
        (UNLIMITED, description(), r"'thumb_1' has no limits; give them under \[limits\]"),
        (SPRUNG, without("thumb_1"), r"'thumb_1' is held by a spring only. Say under \[couplings\]"),
        (LOOP, description(), r"'thumb_1' and 'first_2' close a loop. .* \[couplings\]"),
        (CURVED, without("thumb_1"), r"thumb_1 follows thumb_0 by a polynomial .* under \[couplings\]"),
        (CIRCLE, without("thumb_0", "thumb_1"), "couplings of thumb_1, thumb_0 go round in a circle"),
        (hand_mjcf(), NO_TORQUE, r"No torque limit is known for thumb_0, .* under \[torque_limits\]"),
        (
            hand_mjcf().replace('name="plate" type="box"', 'name="plate" type="plane"'),
            description(),
            "'plate' is a plane",
        ),
        (WIDE, description(), "more than 256 covering spheres"),
        (hand_mjcf(), with_grip(jaws=[["first"], ["thumb"]]), "at least three fingers"),
        (hand_mjcf(), with_grip(jaws=[["first", "fifth"], ["thumb"]]), "a grip names the finger 'fifth'"),
        (hand_mjcf(), with_grip(approach_axis=[0.0, 1.0, 1.0]), "must be across each other"),
        (hand_mjcf(), with_grip(preshapes=[{"thumb_0": 3.0}]), "preshape 0 puts thumb_0 at 3 rad; it goes from -0.52"),
        (hand_mjcf(), with_grip(preshapes=[{}] * 9), "9 preshapes; at most 8"),
        (hand_mjcf(), with_grip(opening=[0.2, 0.1]), "the first number must be below the second"),
        (hand_mjcf(), with_grip(parked={"fourth_1": 0.1}), "parked names 'fourth_1'; the hand's drivers are thumb_0"),
        ("<mujoco><worldbody>", description(), "hand.xml does not compile"),
    ],
)
def test_what_no_kernel_computes_is_refused(own_hand, mjcf, described, said):
    with pytest.raises(HandError, match=f"^own.*{said}"):
        own_hand(mjcf, described)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"title": 3}, "title: It must be a text. It is 3."),
        ({"palm": ""}, "palm: It must not be empty."),
        ({"torque_limits": {"thumb_0": "strong"}}, 'torque_limits.thumb_0: It must be a number. It is "strong".'),
        ({"torque_limits": 3}, "torque_limits: It must be a table. It is 3."),
        ({"couplings": {"thumb_0": {"driver": "x"}}}, "couplings.thumb_0.ratio: This field is needed."),
        ({"shapes": {"budgets": 9}}, "shapes.budgets: There is no such field. Did you mean 'budget'?"),
        ({"limits": {"thumb_0": [0.5]}}, "limits.thumb_0.1: The list is too short: it has no entry 1, counted from 0."),
    ],
)
def test_faults_of_a_description_name_the_field_and_what_would_be_right(own_hand, changes, said):
    with pytest.raises(HandError, match=rf"hand\.toml: {re.escape(said)}$"):
        own_hand(hand_mjcf(), description() | changes)


def test_a_slide_is_held_where_the_description_says(own_hand):
    places = []
    for length in (0.0, 0.01):
        hand = own_hand(SLIDING, without("thumb_1") | {"fixed": {"thumb_1": length}})
        joints = np.zeros(len(hand.joint_names))
        places.append(hand.pose(joints).pads[ACTIVE.index("thumb")])
    assert np.linalg.norm(places[1] - places[0]) == pytest.approx(0.01)


def test_more_fingers_than_the_kernels_have_room_for_are_refused(own_hand):
    described = description()
    names = [f"finger{k}" for k in range(6)]
    described["fingers"] += [{"name": name, "pads": [{"site": "second_pad"}]} for name in names]
    described["grips"][0]["jaws"] = [names, ["thumb"]]
    with pytest.raises(HandError, match="7 active fingers; at most 5"):
        own_hand(hand_mjcf(), described)


def test_more_shapes_than_the_kernels_have_room_for_are_merged(own_hand):
    plates = "".join(f'<geom name="extra{k}" pos="{0.001 * k} 0 0" size="0.01"/>' for k in range(60))
    hand = own_hand(hand_mjcf().replace('<geom name="plate"', f'{plates}<geom name="plate"'))
    merged = [shape for shape in hand.model.shapes if len(shape.sources) > 1]
    assert {source for shape in hand.model.shapes for source in shape.sources} == {
        solid.name for solid in hand.model.solids
    }
    assert merged
    assert all(shape.link == 0 for shape in merged)


def test_other_grips_are_tried_where_the_first_finds_nothing(own_hand, prepared):
    described = description()
    (usual,) = described["grips"]
    three = {"jaws": [["first", "third"], ["thumb"]], "parked": {"second_0": -0.4}}
    described["grips"] = [usual | {"opening": [0.001, 0.002]}, usual | three]
    hand, model = own_hand(hand_mjcf(), described), prepared("sphere")
    result = plan(model, hand, starts=16, seed=0, top_k=2)
    assert result.summary.feasible
    assert [contact.finger for contact in result.grasps[0].contacts] == ["first", "third", "thumb"]
    assert result.active_grip(hand) is hand.grips[1]
    assert plan(model, hand.alone(), starts=16, seed=0).summary.feasible == 0
    verified = verify_ranked(result, model, hand, decompose(model.mesh), verified=1)
    assert verified.grasps[0].verification is not None
    assert replay(result, 1, model, hand).grasp == result.grasps[0]
