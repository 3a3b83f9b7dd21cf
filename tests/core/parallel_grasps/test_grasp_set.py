"""Many parallel grasps in a few arrays behave as a sequence of parallel grasps."""

import numpy as np
import pytest

from fingersplit.errors import ParallelGraspError
from fingersplit.parallel_grasps import ParallelGrasp, ParallelGrasps

CONTACTS = np.array([[[0.03, 0, 0.01 * i], [-0.03, 0, 0.01 * i]] for i in range(4)])
APPROACHES = np.array([[0, 0, -2.0], [0, 1, 0], [0, 0.6, 0.8], [0, 0, 1]])


def test_rows_are_parallel_grasps():
    grasps = ParallelGrasps(CONTACTS, APPROACHES)
    assert len(grasps) == 4
    for i, grasp in enumerate(grasps):
        assert isinstance(grasp, ParallelGrasp)
        np.testing.assert_array_equal(grasp.contacts, CONTACTS[i])
        assert np.linalg.norm(grasp.approach) == pytest.approx(1)
        assert ParallelGrasp.from_document(grasp.to_document()).to_document() == grasp.to_document()
    np.testing.assert_array_equal(grasps[-1].contacts, CONTACTS[3])
    with pytest.raises(IndexError):
        grasps[4]


def test_slices_and_round_trip():
    grasps = ParallelGrasps(CONTACTS, APPROACHES)
    part = grasps[1:3]
    assert isinstance(part, ParallelGrasps)
    np.testing.assert_array_equal(part.approaches, grasps.approaches[1:3])
    again = ParallelGrasps.from_grasps(list(grasps))
    np.testing.assert_array_equal(again.contacts, grasps.contacts)
    assert len(ParallelGrasps.from_grasps([])) == 0
    assert not ParallelGrasps.from_grasps([])


def test_arrays_are_own_and_read_only():
    source = CONTACTS.copy()
    grasps = ParallelGrasps(source, APPROACHES)
    source[0] = 9
    assert grasps.contacts.max() < 1
    for array in (grasps.contacts, grasps.approaches, grasps[0].contacts, grasps[0].approach):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(
    ("row", "contacts", "approach", "message"),
    [
        (1, [[0, 0, 0], [0, 0, 0]], [0, 0, 1], "contacts of parallel grasp 2 coincide"),
        (2, [[1, 0, 0], [0, 0, 0]], [0, 0, 0], "approach of parallel grasp 3 has no length"),
        (3, [[1, 0, 0], [0, 0, 0]], [1, 0, 0.01], "approach of parallel grasp 4 runs along the line"),
        (0, [[np.nan, 0, 0], [0, 0, 0]], [0, 0, 1], "numbers of parallel grasp 1 must be finite"),
    ],
)
def test_first_bad_row_is_named(row, contacts, approach, message):
    all_contacts, approaches = CONTACTS.copy(), APPROACHES.copy()
    all_contacts[row], approaches[row] = contacts, approach
    with pytest.raises(ParallelGraspError, match=message):
        ParallelGrasps(all_contacts, approaches)
