"""Results survive JSON exactly, and whatever is no result of this version is refused with a sentence that says why."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.errors import ResultError
from fingersplit.objects.intake import read_file
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.source import ObjectSource
from fingersplit.planning.planning import plan
from fingersplit.planning.search import find_grasps
from fingersplit.result import PlanResult, read_result, write_result
from fingersplit.result.grasp import Contact, Iterations
from fingersplit.result.schema import SCHEMAS, client_modules
from fingersplit.result.wire import from_dict, to_dict
from fingersplit.splitting.settings import PlannerSettings
from fingersplit_client.schemas import PlanResult as ClientResult

SETTINGS = PlannerSettings.of("default", pad_angle_limit=0.5, line_search=True)


@pytest.fixture(scope="module")
def model():
    return prepare_object(box(), "box", ObjectOptions(mass=0.3, fairing=0.002, friction=0.5))


@pytest.fixture(scope="module")
def result(model, barrett):
    return plan(model, barrett, starts=8, seed=1, top_k=3, settings=SETTINGS)


@pytest.fixture
def document(result):
    return json.loads(json.dumps(result.to_dict()))


def test_json_gives_the_same_result_again(result, document):
    again = PlanResult.from_dict(document)
    assert again == result
    assert json.dumps(again.to_dict()) == json.dumps(document)


@pytest.mark.parametrize("kind", ["mesh", "cloud"])
def test_reports_of_either_kind_survive_json(result, kind, tmp_path):
    solid = box().trimesh
    if kind == "mesh":
        solid.export(tmp_path / "object.ply")
    else:
        points, _ = trimesh.sample.sample_surface(solid, 500, seed=1)
        trimesh.PointCloud(points).export(tmp_path / "object.ply")
    _, report = read_file(tmp_path / "object.ply", ObjectSource())
    stored = replace(result, object=replace(result.object, report=report))
    document = json.loads(json.dumps(stored.to_dict()))
    assert PlanResult.from_dict(document) == stored
    assert ClientResult.model_validate(document).model_dump(mode="json") == document


def test_the_client_reads_the_same_document(document):
    assert ClientResult.model_validate(document).model_dump(mode="json") == document


def test_files_hold_the_same_result(result, tmp_path):
    write_result(result, tmp_path / "plan.json")
    assert read_result(tmp_path / "plan.json") == result


def test_arrays_of_a_stored_grasp_are_those_of_its_run(result, model, barrett):
    found = find_grasps(model, barrett, starts=8, seed=1, top_k=3, settings=SETTINGS)
    assert len(result.grasps) == len(found.grasps) > 0
    for stored, ranked in zip(result.grasps, found.grasps, strict=True):
        for one, other in ((stored, ranked.run.final), (stored.initial, ranked.run.initial)):
            grasp = one.for_hand(barrett)
            np.testing.assert_allclose(grasp.object_from_palm, other.object_from_palm, atol=1e-15)
            for name in ("joints", "contacts", "normals", "fingertips", "residuals", "pad_angles"):
                np.testing.assert_array_equal(getattr(grasp, name), getattr(other, name))


def test_provenance_names_everything_that_was_given(result, model):
    origin = result.provenance
    assert origin.planner == SETTINGS.to_document()
    assert result.object.options == ObjectOptions(mass=0.3, fairing=0.002, friction=0.5)
    assert (result.hand, result.seed, result.starts, origin.top_k) == ("barrett", 1, 8, 3)
    assert result.friction == 0.5
    assert origin.parallel_grasps == "antipodal"
    assert len(origin.hand_sha256) == 64
    assert result.object.mass == pytest.approx(0.3)


def refused(document, said):
    with pytest.raises(ResultError, match=said):
        PlanResult.from_dict(document)


@pytest.mark.parametrize("document", [None, 3, "text", [], {}, {"grasps": []}, {"hand": "barrett", "object": {}}])
def test_what_is_no_result_is_refused(document):
    refused(document, "not a result of Fingersplit")


def test_other_schema_versions_are_refused(document):
    refused(document | {"schema_version": 1}, "has schema_version 1; this version of Fingersplit reads 2")
    refused(document | {"schema_version": 3}, "has schema_version 3")
    del document["schema_version"]
    refused(document, r"has no schema_version.*plan again")


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("grasps", 0, "palm", "position"), [0, 0], r"grasps\[0\]\.palm\.position must be a list of 3; it is \[0, 0\]"),
        (("grasps", 0, "palm", "wxyz", 2), "x", r"grasps\[0\]\.palm\.wxyz\[2\] must be a finite number; it is 'x'"),
        (("grasps", 1, "rank"), 1.5, r"grasps\[1\]\.rank must be a whole number; it is 1\.5"),
        (("grasps", 0, "feasible"), 1, r"grasps\[0\]\.feasible must be true or false"),
        (("grasps", 0, "termination"), "bored", r"grasps\[0\]\.termination must be 'converged' or "),
        (("grasps", 0, "joints"), [1], r"grasps\[0\]\.joints must be an object with named values"),
        (("grasps", 0, "speed"), 3, r"grasps\[0\] has 'speed', which this version does not know"),
        (("object", "mass"), math.nan, r"object\.mass must be a finite number"),
        (("object", "options", "mass"), -1.0, r"object\.options: Object option 'mass' is -1\.0"),
        (("provenance", "planner", "x"), [], r"provenance\.planner\.x must be a text"),
        (("hand",), 7, "hand must be a text; it is 7"),
        (("grasps",), {}, r"grasps must be a list"),
    ],
)
def test_a_wrong_field_is_named(document, path, value, said):
    part = document
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    refused(document, said)


def test_a_missing_field_is_named(document):
    del document["grasps"][0]["initial"]["contacts"]
    refused(document, r"grasps\[0\]\.initial lacks 'contacts'")


def test_files_that_hold_none_are_named(tmp_path):
    for name, content, said in (
        ("torn.json", b'{"hand": "barr', "is not JSON"),
        ("bytes.json", b"\xff\xfe\x00", "is not JSON"),
        ("deep.json", b"[" * 100_000, "is not JSON"),
        ("list.json", b"[]", "not a result of Fingersplit"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ResultError, match=rf"{name}.*{said}"):
            read_result(tmp_path / name)
    with pytest.raises(ResultError, match=r"nowhere\.json cannot be read: No such file"):
        read_result(tmp_path / "nowhere.json")


def test_another_hand_is_refused(result, model, barrett):
    result.check_origin(model, barrett)
    altered = replace(result, provenance=replace(result.provenance, hand_sha256="0" * 64))
    with pytest.raises(ResultError, match="description of the hand 'barrett' was altered"):
        altered.check_origin(model, barrett)
    with pytest.raises(ResultError, match="planned for the hand 'other', not for 'barrett'"):
        replace(result, hand="other").check_origin(model, barrett)


numbers = st.floats(allow_nan=False, allow_infinity=False)
vectors = st.tuples(numbers, numbers, numbers)


@given(
    st.builds(
        Contact,
        finger=st.text(),
        position=vectors,
        normal=vectors,
        fingertip=vectors,
        residual=numbers,
        pad_angle=numbers,
        force=st.none() | vectors,
    )
)
def test_any_contact_survives_json(contact):
    assert from_dict(Contact, json.loads(json.dumps(to_dict(contact)))) == contact


@given(st.recursive(st.none() | st.booleans() | numbers | st.text(), st.lists))
def test_anything_but_a_whole_number_is_refused_in_words(value):
    with pytest.raises(ResultError, match=r"^The document must be an object with named fields; it is .*\.$"):
        from_dict(Iterations, value)
    with pytest.raises(ResultError, match=r"^outer must be a whole number; it is .*\.$"):
        from_dict(Iterations, {"outer": value, "cpo": 1, "ppo": 2})


def test_the_clients_schemas_are_those_of_the_dataclasses():
    for name, source in client_modules().items():
        written = (SCHEMAS / f"{name}.py").read_text()
        assert written == source, f"{name}.py is stale: run `python -m fingersplit.result.schema`"


def test_the_generated_schemas_are_formatted(tmp_path):
    subprocess.run([sys.executable, "-m", "fingersplit.result.schema", str(tmp_path)], check=True, timeout=120)
    assert {path.stem for path in tmp_path.iterdir()} == set(client_modules())
    configuration = Path(__file__).parents[3] / "pyproject.toml"
    for command in (["format", "--check"], ["check"]):
        done = subprocess.run(
            [sys.executable, "-m", "ruff", *command, "--config", str(configuration), str(tmp_path)],
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )
        assert done.returncode == 0, done.stdout
