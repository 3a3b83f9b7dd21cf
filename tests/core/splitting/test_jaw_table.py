"""The hand as a parallel gripper: where its pads really are, by MuJoCo, for the joints that the table knows."""

from dataclasses import replace

import numpy as np
import pytest

from fingersplit.errors import HandError
from fingersplit.hands.limits import MAX_PRESHAPES
from fingersplit.splitting.jaw_table import OPENINGS, STANDOFFS, JawTable, jaw_table


@pytest.fixture(scope="module")
def table(barrett) -> JawTable:
    return jaw_table(barrett)


def places(table: JawTable, preshape: int, opening: int, standoff: int, radii: np.ndarray) -> np.ndarray:
    """Where the pads belong, in the palm frame (F, 3): beside each other about either end of the opening."""
    lateral, jaw, approach = table.palm_from_gripper.T
    sides = np.where(table.groups == 0, 1.0, -1.0)
    across = table.center[0] + table.lateral_offsets[preshape]
    along = table.center[1] + sides * (table.openings[opening] / 2 + radii)
    return np.outer(across, lateral) + np.outer(along, jaw) + table.standoffs[standoff] * approach


def test_table_has_an_entry_for_every_combination(barrett, table):
    preshapes = len(barrett.gripper.preshapes)
    assert table.drivers.shape == (preshapes, OPENINGS, STANDOFFS, 8)
    assert table.errors.shape == (preshapes, OPENINGS, STANDOFFS)
    assert table.lateral_offsets.shape == (preshapes, 3)
    assert (table.openings[0], table.openings[-1]) == barrett.gripper.opening
    assert (table.standoffs[0], table.standoffs[-1]) == barrett.gripper.standoff
    assert np.ptp(np.diff(table.openings)) < 1e-12
    assert (table.drivers >= barrett.lower).all()
    assert (table.drivers <= barrett.upper).all()


def test_pads_are_where_the_table_says_by_as_much_as_it_says(barrett, mujoco_barrett, table):
    """Every entry: the farthest pad is exactly as far from its place as ``errors`` tells."""
    radii = np.array([finger.pad_radius for finger in barrett.fingers])
    for entry in np.ndindex(table.errors.shape):
        mujoco_barrett.move(dict(zip(barrett.joint_names, table.drivers[entry], strict=True)))
        pads = np.array([mujoco_barrett.site(f"{finger.name}_pad")[0] for finger in barrett.fingers])
        apart = np.linalg.norm(pads - places(table, *entry, radii), axis=1)
        assert apart.max() == pytest.approx(table.errors[entry], abs=1e-9), entry


def test_much_of_what_the_hand_can_span_is_reached(table):
    """A fifth of all combinations to a tenth of a millimetre, and every opening up to 12 cm at some standoff."""
    reached = table.errors < 1e-4
    assert reached.mean() > 0.2
    wanted = table.openings <= 0.12
    assert reached.any(axis=(0, 2))[wanted].all()
    assert (table.errors > 0.01).any()  # and what is out of reach is known to be


def test_lateral_offsets_balance_in_either_jaw(barrett, table):
    for group in (0, 1):
        np.testing.assert_allclose(table.lateral_offsets[:, table.groups == group].sum(axis=1), 0, atol=1e-12)
    for preshape, offsets in zip(barrett.gripper.preshapes, table.lateral_offsets, strict=True):
        lateral = barrett.pose(preshape).pads[:3] @ table.palm_from_gripper[:, 0]
        assert offsets[0] - offsets[1] == pytest.approx(lateral[0] - lateral[1], abs=1e-12)


@pytest.mark.parametrize("count", [0, MAX_PRESHAPES + 1])
def test_a_hand_with_no_preshape_or_more_than_there_is_room_for_is_refused(barrett, count):
    preshapes = np.tile(barrett.gripper.preshapes[:1], (count, 1))
    hand = replace(barrett, gripper=barrett.gripper._replace(preshapes=preshapes))
    with pytest.raises(HandError, match=f"has {count} preshapes; give 1 to {MAX_PRESHAPES}"):
        jaw_table(hand)


def test_as_many_preshapes_as_there_is_room_for_are_tabled(barrett):
    preshapes = np.tile(barrett.gripper.preshapes[:1], (MAX_PRESHAPES, 1))
    table = jaw_table(replace(barrett, gripper=barrett.gripper._replace(preshapes=preshapes)))
    assert table.drivers.shape[0] == MAX_PRESHAPES
    np.testing.assert_array_equal(table.errors, np.broadcast_to(table.errors[:1], table.errors.shape))


def test_table_of_a_hand_is_made_once(barrett, table):
    assert jaw_table(barrett) is table
