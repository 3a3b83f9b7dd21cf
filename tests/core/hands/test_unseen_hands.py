"""Hands that no description knows, as URDF and MJCF: drafted from the file alone, planned with and lifted with."""

from functools import partial

import numpy as np
import pytest

from fingersplit.hands import load_hand
from fingersplit.hands.draft import draft_folder
from fingersplit.hands.forward import link_poses
from fingersplit.objects.convex_pieces import decompose
from fingersplit.planning.planning import plan
from fingersplit.verification import verify_ranked
from fingersplit.verification.protocols import load_protocol
from five_fingers import OFFSET, RATIO, write_five_fingers
from urdf_hands import write_urdf

DRIVERS = {"three": 3, "five": 6}


@pytest.fixture(scope="module", params=DRIVERS)
def drafted(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    write = write_five_fingers if request.param == "five" else partial(write_urdf, name=request.param)
    model = write(folder / "model")
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


def test_a_drafted_hand_lifts(drafted, prepared):
    name, hand = drafted
    model = prepared("cylinder")
    planned = plan(model, hand, starts=32, seed=1)
    assert planned.feasible > 0
    pieces = decompose(model.mesh)
    checked = verify_ranked(planned, model, hand, pieces, verified=1, protocol=load_protocol("lift"), threads=1)
    held = [grasp for grasp in checked.grasps if grasp.verification and grasp.verification.passed]
    assert len(held) == 1
    if name == "five":
        joints = held[0].joints
        for finger in ("index", "middle", "ring", "little"):
            assert joints[f"{finger}_pip"] == pytest.approx(RATIO * joints[f"{finger}_mcp"] + OFFSET, abs=1e-9)
