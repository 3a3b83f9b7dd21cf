"""The hand as a parallel gripper: where its pads really are, by MuJoCo, for the joints that the table knows."""

import numpy as np
import pytest

from fingersplit.splitting.jaw_table import OPENINGS, STANDOFFS, JawTable, jaw_table
from fingersplit.splitting.state import MAX_PRESHAPES, MAX_STANDOFFS


@pytest.fixture(scope="module")
def table(barrett) -> JawTable:
    return jaw_table(barrett)


def places(table: JawTable, preshape: int, opening: int, standoff: int, radii: np.ndarray) -> np.ndarray:
    """Where the pads belong, in the palm frame (F, 3): beside each other about either end of the opening."""
    lateral, jaw, approach = table.palm_from_gripper.T
    sides = np.where(table.groups == 0, 1.0, -1.0)
    across = table.center[0] + table.asides[preshape]
    along = table.center[1] + sides * (table.openings[opening] / 2 + radii)
    return np.outer(across, lateral) + np.outer(along, jaw) + table.standoffs[standoff] * approach


def test_table_has_an_entry_for_every_combination(barrett, table):
    preshapes = len(barrett.gripper.preshapes)
    assert table.joints.shape == (preshapes, OPENINGS, STANDOFFS, 8)
    assert table.errors.shape == (preshapes, OPENINGS, STANDOFFS)
    assert table.asides.shape == (preshapes, 3)
    assert preshapes <= MAX_PRESHAPES
    assert STANDOFFS <= MAX_STANDOFFS
    assert (table.openings[0], table.openings[-1]) == barrett.gripper.opening
    assert (table.standoffs[0], table.standoffs[-1]) == barrett.gripper.standoff
    assert np.ptp(np.diff(table.openings)) < 1e-12
    assert (table.joints >= barrett.lower).all()
    assert (table.joints <= barrett.upper).all()


def test_pads_are_where_the_table_says_by_as_much_as_it_says(barrett, mujoco_barrett, table):
    """Every entry: the farthest pad is exactly as far from its place as ``errors`` tells."""
    radii = np.array([finger.pad_radius for finger in barrett.fingers])
    for entry in np.ndindex(table.errors.shape):
        mujoco_barrett.move(dict(zip(barrett.joint_names, table.joints[entry], strict=True)))
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


def test_asides_balance_in_either_jaw(barrett, table):
    for group in (0, 1):
        np.testing.assert_allclose(table.asides[:, table.groups == group].sum(axis=1), 0, atol=1e-12)
    for preshape, asides in zip(barrett.gripper.preshapes, table.asides, strict=True):
        lateral = barrett.pose(preshape).pads[:3] @ table.palm_from_gripper[:, 0]
        assert asides[0] - asides[1] == pytest.approx(lateral[0] - lateral[1], abs=1e-12)


def test_table_of_a_hand_is_made_once(barrett, table):
    assert jaw_table(barrett) is table
