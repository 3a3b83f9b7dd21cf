"""Grasps come back from files as they were planned, and fare the same in simulation."""

import numpy as np
import pytest

from fingersplit.errors import ExchangeError
from fingersplit.formats import export
from fingersplit.formats.stored_grasps import grasp_at, read_stored_grasps
from fingersplit.planning.planning import plan


@pytest.fixture(scope="module")
def found(prepared, barrett):
    return plan(prepared("box"), barrett, starts=8, seed=1, top_k=3)


@pytest.fixture(scope="module")
def files(found, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stored")
    (folder / "best.npy").write_bytes(export(found, "dexgraspbench"))
    (folder / "all.yaml").write_bytes(export(found, "isaac_grasp"))
    (folder / "no.txt").write_text("")
    return folder


@pytest.mark.parametrize("name", ["best.npy", "all.yaml"])
def test_best_grasp_comes_back(found, files, barrett, prepared, name):
    stored = read_stored_grasps(files / name, "barrett")
    planned = found.grasps[0].for_hand(barrett)
    again = grasp_at(prepared("box"), stored.hand, stored.grasps[0].pose)
    np.testing.assert_allclose(again.object_from_palm, planned.object_from_palm, atol=1e-6)
    np.testing.assert_allclose(again.joints, planned.joints, atol=1e-6)
    np.testing.assert_allclose(again.contacts, planned.contacts, atol=1e-5)
    np.testing.assert_allclose(again.fingertips, planned.fingertips, atol=1e-5)
    np.testing.assert_allclose(again.normals, planned.normals, atol=1e-3)
    np.testing.assert_allclose(again.residuals, planned.residuals, atol=1e-5)
    np.testing.assert_allclose(again.pad_angles, planned.pad_angles, atol=1e-3)


def test_other_files_are_refused(files):
    with pytest.raises(ExchangeError, match=r"ends in '\.txt'"):
        read_stored_grasps(files / "no.txt", "barrett")
