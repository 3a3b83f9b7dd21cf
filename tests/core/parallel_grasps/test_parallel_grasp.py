"""What is and what is no parallel grasp."""

import numpy as np
import pytest

from fingersplit.errors import ParallelGraspError
from fingersplit.parallel_grasps import ParallelGrasp

CONTACTS = [[0.03, 0.0, 0.01], [-0.03, 0.0, 0.01]]


def test_approach_becomes_unit_and_arrays_read_only():
    grasp = ParallelGrasp(CONTACTS, [0, 0, -5])
    np.testing.assert_array_equal(grasp.approach, [0, 0, -1])
    for array in (grasp.contacts, grasp.approach):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_source_may_change_afterwards():
    contacts = np.array(CONTACTS)
    grasp = ParallelGrasp(contacts, np.array([0, 0, -1.0]))
    contacts[0, 0] = 9
    assert grasp.contacts[0, 0] == 0.03


def test_document_round_trip():
    document = {"contacts": CONTACTS, "approach": [0.0, 0.6, 0.8]}
    again = ParallelGrasp.from_document(ParallelGrasp.from_document(document).to_document())
    np.testing.assert_allclose(again.contacts, CONTACTS)
    np.testing.assert_allclose(again.approach, [0, 0.6, 0.8])


@pytest.mark.parametrize(
    ("contacts", "approach", "message"),
    [
        ([[0.03, 0, 0]], [0, 0, 1], r"The contacts of a parallel grasp must be two points"),
        ([[0.03, 0], [0.01, 0]], [0, 0, 1], r"The contacts of a parallel grasp must be two points"),
        ("two points", [0, 0, 1], r"two points \[\[x, y, z\], \[x, y, z\]\] of numbers, got 'two points'"),
        ([[0.03, 0, None], [0, 0, 0]], [0, 0, 1], r"The contacts of a parallel grasp must be (two points|finite)"),
        (CONTACTS, [0, 1], r"The approach of a parallel grasp must be a vector \[x, y, z\] of numbers, got \[0, 1\]"),
        (CONTACTS, None, r"The approach of a parallel grasp must be a vector"),
        ([[np.nan, 0, 0], [0, 0, 0]], [0, 0, 1], r"The contacts of a parallel grasp must be finite, got"),
        (CONTACTS, [0, np.inf, 0], r"The approach of a parallel grasp must be finite, got \[0.0, inf, 0.0\]"),
        ([[0.03, 0, 0], [0.03, 0, 0]], [0, 0, 1], r"The two contacts of a parallel grasp coincide"),
        (CONTACTS, [0, 0, 0], r"The approach of a parallel grasp has no length"),
        (CONTACTS, [1, 0, 0.01], r"runs along the line between its contacts; give a direction across that line"),
    ],
)
def test_no_parallel_grasp(contacts, approach, message):
    with pytest.raises(ParallelGraspError, match=message):
        ParallelGrasp(contacts, approach)


@pytest.mark.parametrize("missing", ["contacts", "approach"])
def test_missing_key_is_named(missing):
    document = {"contacts": CONTACTS, "approach": [0, 0, 1]}
    del document[missing]
    with pytest.raises(ParallelGraspError, match=f"missing: '{missing}'"):
        ParallelGrasp.from_document(document)
