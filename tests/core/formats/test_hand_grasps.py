"""Grasps come back from files as they were planned, and fare the same in simulation."""

import numpy as np
import pytest
import yaml

from fingersplit.errors import FormatError
from fingersplit.formats import export, grasp_at, read_hand_grasps
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
    stored = read_hand_grasps(files / name, "barrett")
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
    with pytest.raises(FormatError, match=r"no known format; known: DexGraspBench sample \.npy, Isaac grasp YAML"):
        read_hand_grasps(files / "no.txt", "barrett")


def test_a_file_without_joints_is_no_file_of_a_hand(files, tmp_path):
    """GraspGen's data generation lists grasps with the joints before the grasp only."""
    whole = yaml.safe_load((files / "all.yaml").read_bytes())
    for grasp in whole["grasps"].values():
        del grasp["cspace_position"]
    (tmp_path / "before.yaml").write_text(yaml.safe_dump(whole | {"format_version": "1.0"}))
    with pytest.raises(FormatError, match="cspace_position of grasp_0 does not say where joint 'finger1_"):
        read_hand_grasps(tmp_path / "before.yaml", "barrett")
