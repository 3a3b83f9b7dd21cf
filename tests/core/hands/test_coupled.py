"""Coupled hands: what the model couples becomes S and q0, and the simulation holds it."""

import mujoco
import numpy as np
import pytest

from fingersplit.errors import HandError
from fingersplit.hands import load_hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.parametric import sphere
from fingersplit.verification.scene import Scene
from fingersplit.verification.scene_parts import drive_joints, limit_joints
from own_hand import description, hand_mjcf, write_hand

EQUALITY = '<equality><joint joint1="{}" joint2="{}" polycoef="{} {} 0 0 0"/></equality>'


def without(*names: str) -> dict:
    described = description()
    for name in names:
        del described["torque_limits"][name], described["grips"][0]["preshapes"][0][name]
    return described


def rows(hand) -> dict[str, tuple[dict[str, float], float]]:
    coupling = hand.model.coupling
    return {
        name: ({coupling.drivers[a]: row[a] for a in np.flatnonzero(row)}, offset)
        for name, row, offset in zip(hand.joint_names, coupling.matrix, coupling.offset, strict=True)
        if name not in coupling.drivers
    }


@pytest.mark.parametrize("reference", ["", 'ref="10"'])
def test_joint_equality_becomes_a_row(tmp_path, reference):
    mjcf = hand_mjcf(extra=reference, after=EQUALITY.format("thumb_1", "thumb_0", 0.1, 0.5))
    hand = load_hand(write_hand(tmp_path / "own", mjcf, without("thumb_1")))
    (ratios, offset) = rows(hand)["thumb_1"]
    assert ratios == {"thumb_0": pytest.approx(0.5)}
    angle = np.deg2rad(10) if reference else 0.0
    assert offset == pytest.approx(angle + 0.1 - 0.5 * angle)
    assert "thumb_1" not in hand.driver_names
    thumb = hand.model.coupling.drivers.index("thumb_0")
    for low_or_high in (hand.model.coupling.lower[thumb], hand.model.coupling.upper[thumb]):
        followed = ratios["thumb_0"] * low_or_high + offset
        assert hand.model.joints[1].lower - 1e-9 <= followed <= hand.model.joints[1].upper + 1e-9


def test_tendon_shared_by_two_joints_becomes_a_row_and_its_torque_adds_up(tmp_path):
    after = (
        '<tendon><fixed name="pull"><joint joint="thumb_0" coef="1"/>'
        '<joint joint="thumb_1" coef="0.5"/></fixed></tendon>'
        '<actuator><motor tendon="pull" ctrlrange="-2 2"/>'
        + "".join(
            f'<motor joint="{name}" ctrlrange="-1 1"/>' for name in without("thumb_0", "thumb_1")["torque_limits"]
        )
        + "</actuator>"
    )
    described = without("thumb_0", "thumb_1") | {"torque_limits": {}}
    described["grips"][0]["preshapes"] = [{}]
    hand = load_hand(write_hand(tmp_path / "own", hand_mjcf(after=after), described))
    assert rows(hand) == {"thumb_1": ({"thumb_0": 0.5}, 0.0)}
    torque = dict(zip(hand.model.coupling.drivers, hand.model.coupling.torque_limits, strict=True))
    assert torque["thumb_0"] == pytest.approx(2 * (1 + 0.5 * 0.5))
    assert torque["first_1"] == pytest.approx(1)


def test_torques_that_differ_by_direction_stay_so(tmp_path):
    """A motor's force range, through a gear that turns it round and a joint that follows backwards."""
    names = without("thumb_1")["torque_limits"]
    motors = "".join(
        f'<general joint="{name}" gear="{-2 if name == "first_1" else 1}" forcelimited="true" forcerange="-0.3 1.2"/>'
        for name in names
    )
    after = EQUALITY.format("thumb_1", "thumb_0", 0.1, -0.5) + f"<actuator>{motors}</actuator>"
    hand = load_hand(write_hand(tmp_path / "own", hand_mjcf(after=after), without("thumb_1") | {"torque_limits": {}}))
    ranges = dict(zip(hand.model.coupling.drivers, hand.model.coupling.torque_ranges.T, strict=True))
    assert ranges["thumb_0"] == pytest.approx([1.2, 0.3])
    assert ranges["first_1"] == pytest.approx([0.6, 2.4])
    assert hand.torque_limits[hand.driver_names.index("first_1")] == pytest.approx(0.6)
    spec = hand.spec()
    limit_joints(spec, hand)
    drive_joints(spec, hand)
    assert spec.joint("thumb_0").actfrcrange == pytest.approx([-0.3, 1.2])
    assert spec.joint("thumb_1").actfrcrange == pytest.approx([-2.4, 0.6])


def test_the_descriptions_coupling_takes_the_models_place(tmp_path):
    described = without("thumb_1") | {"couplings": {"thumb_1": {"driver": "thumb_0", "ratio": 0.25, "offset": 0.0}}}
    mjcf = hand_mjcf(after=EQUALITY.format("thumb_1", "thumb_0", 0.1, 0.5))
    hand = load_hand(write_hand(tmp_path / "own", mjcf, described))
    assert rows(hand) == {"thumb_1": ({"thumb_0": 0.25}, 0.0)}
    assert any("takes the place" in note for note in hand.model.notes)


def test_slightly_curved_coupling_is_a_line_and_says_so(tmp_path):
    after = '<equality><joint joint1="thumb_1" joint2="thumb_0" polycoef="0 0.5 0.05 0 0"/></equality>'
    hand = load_hand(write_hand(tmp_path / "own", hand_mjcf(after=after), without("thumb_1")))
    assert any("polynomial" in note for note in hand.model.notes)
    (ratios, offset) = rows(hand)["thumb_1"]
    angles = np.linspace(-np.pi / 6, np.pi / 3, 50)
    curve = 0.5 * angles + 0.05 * angles**2
    assert np.abs(ratios["thumb_0"] * angles + offset - curve).max() < 0.05


def test_coupling_that_leaves_its_limits_is_refused(tmp_path):
    after = EQUALITY.format("thumb_1", "thumb_0", 3.0, 0.1)
    with pytest.raises(HandError, match=r"leaves its own limits .* wherever thumb_0 stands"):
        load_hand(write_hand(tmp_path / "own", hand_mjcf(after=after), without("thumb_1")))


def test_driver_of_active_and_parked_fingers_is_refused(tmp_path):
    described = without("second_0")
    described["grips"][0] |= {"jaws": [["first", "third"], ["thumb"]]}
    mjcf = hand_mjcf(after=EQUALITY.format("second_0", "first_0", 0.0, 1.0))
    with pytest.raises(HandError, match="parks the finger of second_0, which moves with an active one"):
        load_hand(write_hand(tmp_path / "own", mjcf, described))


def test_barrett_as_built_has_four_motors():
    hand = load_hand("barrett_coupled")
    assert hand.driver_names == ("finger1_spread", "finger1_proximal", "finger2_proximal", "finger3_proximal")
    assert rows(hand)["finger2_spread"] == ({"finger1_spread": 1.0}, 0.0)
    assert {name: row[0] for name, row in rows(hand).items() if name.endswith("distal")} == {
        f"finger{k}_distal": {f"finger{k}_proximal": pytest.approx(1 / 3)} for k in (1, 2, 3)
    }
    assert hand.arrays.fingers_coupled
    assert not hand.arrays.uncoupled


def test_simulated_couplings_hold_while_a_motor_turns():
    hand = load_hand("barrett_coupled")
    scene = Scene.build(hand, decompose(sphere(0.02)))
    scene.set_joints(hand.gripper.preshapes[0])
    scene.model.opt.gravity = 0.0
    scene.data.qpos[scene.object_qpos] = 1.0  # out of the way
    actuator = scene.joint_controls[1]
    scene.set_gains(scene.joint_controls, 5.0, 0.1)
    scene.data.ctrl[scene.joint_controls] = scene.data.qpos[scene.driver_qpos]
    scene.data.ctrl[actuator] += 0.2
    before = scene.data.qpos[scene.joint_qpos].copy()
    for _ in range(300):
        mujoco.mj_step(scene.model, scene.data)
    joints = scene.data.qpos[scene.joint_qpos]
    coupling = hand.model.coupling
    drivers = scene.data.qpos[scene.driver_qpos]
    assert joints[1] - before[1] > 0.1
    np.testing.assert_allclose(joints, coupling.matrix @ drivers + coupling.offset, atol=2e-3)
