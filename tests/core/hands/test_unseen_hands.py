"""Hands as URDF that no description knows: drafted from the file alone."""

import numpy as np
import pytest

from fingersplit.hands import load_hand
from fingersplit.hands.draft import draft_folder
from fingersplit.hands.forward import link_poses
from urdf_hands import URDF_HANDS, write_urdf

DRIVERS = {"three": 3}


@pytest.fixture(scope="module", params=URDF_HANDS)
def drafted(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    model = write_urdf(folder / "model", request.param)
    draft_folder(model, model.parent, folder / "out")
    return request.param, load_hand(folder / "out")


def test_couplings_and_torques_are_those_of_the_file(drafted):
    name, hand = drafted
    assert len(hand.model.coupling.drivers) == DRIVERS[name]
    assert hand.model.coupling.torque_limits == pytest.approx(1.2)


def test_pads_are_at_the_ends_of_the_fingers_and_face_inwards(drafted):
    _, hand = drafted
    poses = link_poses(hand.model, hand.model.joints_from_drivers(np.zeros(len(hand.model.coupling.drivers))))
    for chain in hand.chains:
        pad = chain.pads[0]
        assert pad.radius == pytest.approx(0.008, abs=2e-3)
        assert pad.center[0] > 0.035
        place, outward = poses[pad.link][:3, 3], poses[pad.link][:3, :3] @ pad.normal
        assert place[:2] @ outward[:2] < 0, chain.name


def test_jaws_approach_out_of_the_palm(drafted):
    _, hand = drafted
    assert hand.gripper.palm_from_gripper[2, 2] > 0.6
