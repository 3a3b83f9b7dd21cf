"""Grasps come back from files as they were planned, and fare the same in simulation."""

import json

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
    folder, document = tmp_path_factory.mktemp("stored"), found.to_document()
    (folder / "plan.json").write_text(json.dumps(document))
    (folder / "best.npy").write_bytes(export(document, "dexgraspbench"))
    (folder / "all.yaml").write_bytes(export(document, "isaac_grasp"))
    (folder / "no.json").write_text('{"hand": "barrett"}')
    (folder / "no.txt").write_text("")
    return folder


@pytest.mark.parametrize("name", ["plan.json", "best.npy", "all.yaml"])
def test_best_grasp_comes_back(found, files, barrett, name):
    stored = read_stored_grasps(files / name, "barrett")
    planned = found.grasps[0].run.final
    again = grasp_at(found.model, stored.hand, stored.grasps[0].final)
    np.testing.assert_allclose(again.object_from_palm, planned.object_from_palm, atol=1e-6)
    np.testing.assert_allclose(again.joints, planned.joints, atol=1e-6)
    np.testing.assert_allclose(again.contacts, planned.contacts, atol=1e-5)
    np.testing.assert_allclose(again.fingertips, planned.fingertips, atol=1e-5)
    np.testing.assert_allclose(again.normals, planned.normals, atol=1e-3)
    np.testing.assert_allclose(again.residuals, planned.residuals, atol=1e-5)
    np.testing.assert_allclose(again.pad_angles, planned.pad_angles, atol=1e-3)
    assert (stored.grasps[0].initial is None) == (name != "plan.json")
    assert stored.friction == (0.6 if name == "plan.json" else None)


@pytest.mark.parametrize(("name", "sentence"), [("no.json", "no result document"), ("no.txt", "ends in '.txt'")])
def test_other_files_are_refused(files, name, sentence):
    with pytest.raises(ExchangeError, match=sentence):
        read_stored_grasps(files / name, "barrett")
