"""Drafts: palm, fingers, tips, normals, couplings and opposition found by moving a model."""

import numpy as np
import pytest

from fingersplit.errors import HandError
from fingersplit.hands import load_hand
from fingersplit.hands.check import check_hand
from fingersplit.hands.check.measures import self_collisions
from fingersplit.hands.description import read_description
from fingersplit.hands.draft import description_to_toml, draft_folder, draft_hand
from fingersplit.hands.draft.structure import find_fingers, find_palm
from fingersplit.hands.files import find_hand
from fingersplit.hands.forward import link_poses
from fingersplit.hands.tree import compile_model
from fingersplit.splitting.jaw_table import jaw_table
from folding_hand import write_folding_hand
from models_folder import models_folder
from own_hand import COUNTS, FINGERS, hand_mjcf


@pytest.fixture(scope="module")
def drafted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own")
    (folder / "model").mkdir()
    (folder / "model" / "hand.xml").write_text(hand_mjcf())
    notes = draft_folder(folder / "model" / "hand.xml", folder / "model", folder / "out")
    return load_hand(folder / "out"), notes


def test_fingers_are_the_chains_and_opposition_is_found(drafted):
    hand, notes = drafted
    assert [(chain.name, len(chain.joints)) for chain in hand.chains] == list(zip(FINGERS, COUNTS, strict=True))
    jaws = [
        {finger.name for finger, jaw in zip(g.fingers, g.gripper.groups, strict=True) if jaw == 1} for g in hand.grips
    ]
    assert jaws[0] == {"thumb"}
    assert hand.description.drafted
    assert any("no torque" in note for note in notes)


def test_pads_are_at_the_tips_and_face_the_other_side(drafted):
    hand, _ = drafted
    poses = link_poses(hand.model, np.zeros(len(hand.joint_names)))
    for chain in hand.chains:
        pad = chain.pads[0]
        length = 0.09 / COUNTS[FINGERS.index(chain.name)]
        assert pad.radius == pytest.approx(0.006, abs=1e-3)
        np.testing.assert_allclose(pad.center, [length, 0, 0], atol=1.5e-3)
        outward = poses[pad.link][:3, :3] @ pad.normal
        assert outward[1] * (1 if chain.name == "thumb" else -1) > 0.5, chain.name


def test_jaw_axis_and_approach_are_the_hands(drafted):
    hand, _ = drafted
    axes = hand.gripper.palm_from_gripper
    assert axes[1, 1] > 0.8  # from the thumb to the fingers
    assert axes[2, 2] > 0.6  # out of the palm


def test_preshapes_put_pads_in_front_of_each_other(drafted):
    hand, _ = drafted
    jaw = hand.gripper.palm_from_gripper[:, 1]
    for joints in hand.gripper.preshapes:
        along = hand.pose(joints).pads[: len(hand.fingers)] @ jaw
        assert along[hand.gripper.groups == 0].min() > along[hand.gripper.groups == 1].max()


def test_preshapes_and_parked_fingers_stay_out_of_the_palm(tmp_path):
    """Fingertips that fold down to face each other are proposed where they are outside of the palm."""
    model = write_folding_hand(tmp_path / "model")
    draft_folder(model, model.parent, tmp_path / "out")
    for grip in load_hand(tmp_path / "out").grips:
        assert min(pair["distance"] for pair in self_collisions(grip)) > 0
        assert (jaw_table(grip).errors < 2e-3).mean() > 0.02, grip.fingers


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (lambda text: text.replace("-30 60", "-0.5 1.1"), "No joint turns by more than 1.6 degrees"),
        (
            lambda text: text.replace('<joint name="thumb_0"', '<joint name="thumb_0" type="ball" limited="false"'),
            "'thumb_0' is no hinge",
        ),
    ],
)
def test_what_is_wrong_with_a_model_is_said(edit, said, tmp_path):
    (tmp_path / "hand.xml").write_text(edit(hand_mjcf()))
    with pytest.raises(HandError, match=said):
        draft_hand(tmp_path / "hand.xml", tmp_path)


@pytest.fixture(scope="module")
def sliding(tmp_path_factory):
    """Description and notes of a hand that has a rail, too."""
    folder, rail = tmp_path_factory.mktemp("sliding"), '<joint name="rail" type="slide" range="0 0.01"/>'
    text = hand_mjcf().replace('<joint name="first_0"', f'{rail}<joint name="first_0"')
    (folder / "hand.xml").write_text(text.replace("<mujoco>", '<mujoco model="Rail hand">'))
    return draft_hand(folder / "hand.xml", folder)


def test_a_draft_is_called_as_the_model_is_or_its_file(sliding, drafted):
    assert (sliding[0].title, drafted[0].title) == ("Rail hand", "hand")


def test_joints_that_slide_are_held(sliding):
    description, notes = sliding
    assert description.fixed == {"rail": 0.0}
    assert any(note.startswith("rail slides") for note in notes)


def test_draft_is_read_back_as_it_was(sliding):
    description, notes = sliding
    assert read_description(description_to_toml(description, notes), "draft") == description


def test_a_description_is_never_overwritten(tmp_path):
    (tmp_path / "hand.xml").write_text(hand_mjcf())
    (tmp_path / "hand.toml").write_text("mine")
    with pytest.raises(HandError, match="exists; move it away"):
        draft_folder(tmp_path / "hand.xml", tmp_path, tmp_path)
    assert (tmp_path / "hand.toml").read_text() == "mine"


def test_model_without_fingers_is_refused(tmp_path):
    (tmp_path / "box.xml").write_text('<mujoco><worldbody><body><geom size="0.1"/></body></worldbody></mujoco>')
    with pytest.raises(HandError, match="fewer than two chains of joints"):
        draft_hand(tmp_path / "box.xml", tmp_path)


PUBLIC = {
    "leap": "leap_hand/right_hand.xml",
    "shadow": "shadow_hand/right_hand.xml",
    "dexee": "shadow_dexee/shadow_dexee.xml",
    "allegro_wonik": "wonik_allegro/right_hand.xml",
    "ability": "ability_hand/ability_hand_right.urdf",
    "robotiq_3f": "robotiq_3f/robotiq_3f.urdf",
    "barrett": None,
    "barrett_coupled": None,
}
COUPLED_BY_HAND = {"robotiq_3f", "barrett_coupled"}
"""Hands whose models say nothing of their couplings."""


@pytest.mark.campaign
@pytest.mark.parametrize("name", PUBLIC)
def test_a_draft_is_the_description_or_the_check_asks_for_what_is_missing(name, tmp_path, monkeypatch):
    """Pads of drafts without edits touch where the described ones do, and couplings are the same."""
    folder = models_folder()
    if PUBLIC[name] is not None and folder is None:
        pytest.skip("no folder of hand models")
    monkeypatch.setenv("FINGERSPLIT_HANDS", str(folder))
    model = folder / PUBLIC[name] if PUBLIC[name] else find_hand("barrett").root / "hand.xml"
    draft_folder(model, model.parent, tmp_path / "out")
    drafted, described = load_hand(tmp_path / "out"), load_hand(name)
    pads = {drafted.model.links[chain.pads[0].link].name: chain.pads[0] for chain in drafted.chains}
    for chain in described.chains:
        known = chain.pads[0]
        found = pads.pop(described.model.links[known.link].name)
        touching = [pad.center + pad.radius * pad.normal for pad in (known, found)]
        assert np.linalg.norm(touching[0] - touching[1]) < 3e-3
        assert known.normal @ found.normal > np.cos(0.3)
    assert not pads
    assert min(len(grip.fingers) for grip in drafted.grips) == 3
    if name in COUPLED_BY_HAND:
        assert any("[couplings]" in text for text in check_hand(drafted)["advice"])
    else:
        known, found = described.model.coupling, drafted.model.coupling
        assert found.drivers == known.drivers
        np.testing.assert_allclose(found.matrix, known.matrix, atol=1e-6)
        np.testing.assert_allclose(found.offset, known.offset, atol=1e-6)


def test_fingers_are_named_in_the_models_language(tmp_path):
    text = hand_mjcf()
    for name, own in zip(FINGERS, ("Daumen ä", "上", "средний", "μικρό", "anular ñ"), strict=False):
        text = text.replace(name, own)
    (tmp_path / "hand.xml").write_text(text, encoding="utf-8")
    compiled, _ = compile_model(tmp_path / "hand.xml", tmp_path)
    names = [finger.name for finger in find_fingers(compiled, find_palm(compiled))]
    assert names[:2] == ["Daumen_ä", "上"]
    assert len(set(names)) == len(FINGERS)
