"""What clients get wrong, and what HTTP lets them do: the answer names the field, the choices, or the header."""

import base64
import gzip
import json

import pytest
from fake_workers import FINE

from fingersplit_client.schemas import Job, ObjectInfo, Problem
from fingersplit_service.endpoints.forms import file_name

pytestmark = pytest.mark.anyio
JSON = {"Content-Type": "application/json"}


def refusal(response, status: int, kind: str) -> Problem:
    problem = Problem.model_validate_json(response.content)
    assert (response.status_code, problem.type) == (status, f"urn:fingersplit:problem:{kind}"), response.text
    for name in ("UploadFile", "dict", "<class", "NoneType"):
        assert name not in response.text
    return problem


@pytest.mark.parametrize(("name", "hint"), [("units", "'unit'"), ("viewpint", "'viewpoint'"), ("colour", "density")])
async def test_an_unknown_form_field_is_refused(api, cube, name, hint):
    response = await api.upload(cube, "cube.off", unit="cm", **{name: "in"})
    problem = refusal(response, 422, "invalid-request")
    assert problem.errors[0].field == f"/{name}"
    assert hint in problem.detail


@pytest.mark.parametrize("twice", ["unit", "file"])
async def test_a_repeated_form_field_is_refused(api, cube, twice):
    files = [("file", ("cube.off", cube)), ("unit", (None, "cm"))]
    files += [one for one in files if one[0] == twice]
    problem = refusal(await api.http.post("/v1/objects", files=files), 422, "invalid-request")
    assert (problem.errors[0].field, "2 times" in problem.detail) == (f"/{twice}", True)


@pytest.mark.parametrize("name", ["unit", "friction", "viewpoint", "scale"])
async def test_an_empty_form_field_is_no_default(api, cube, name):
    files = [("file", ("cube.off", cube)), (name, (None, ""))]
    problem = refusal(await api.http.post("/v1/objects", files=files), 422, "invalid-request")
    assert (problem.errors[0].field, "is empty" in problem.detail) == (f"/{name}", True)


@pytest.mark.parametrize(
    ("name", "value"),
    [("scale", "4_0"), ("scale", "inf"), ("mass", "0_1"), ("viewpoint", "1_0,0,0"), ("support", "٣,0,0,1")],
)
async def test_numbers_of_forms_are_plain_and_finite(api, cube, name, value):
    response = await api.upload(cube, "cube.off", unit="cm", **{name: value})
    assert refusal(response, 422, "invalid-request").errors[0].field == f"/{name}"
    named = await api.upload(cube, "cube.off", unit="cm", name="4_0")
    assert named.is_success
    assert named.json()["name"] == "4_0"


@pytest.mark.parametrize(
    ("query", "field", "words"),
    [
        ("stat=failed", "stat", "Did you mean 'state'?"),
        ("limit=1&limit=2", "limit", "came 2 times"),
        ("pretty=1", "pretty", "known: "),
        ("limit=1_0", "limit", "must be a number"),
    ],
)
async def test_query_parameters_are_exact_too(api, query, field, words):
    for path in ("/v1/jobs", "/v1/jobs/no", "/v1/objects", "/v1/hands"):
        if path == "/v1/jobs" or field == "pretty":
            problem = refusal(await api.http.get(f"{path}?{query}"), 422, "invalid-request")
            assert (problem.errors[0].field, words in problem.detail) == (field, True)
    assert (await api.http.get("/v1/jobs?state=failed&state=running&limit=2")).status_code == 200
    assert (await api.http.get("/healthz?probe=1")).status_code == 200


async def test_a_missing_file_says_how_to_send_one(api):
    for path in ("/v1/objects", "/v1/plan", f"/v1/objects/{await api.object_id()}/parallel-grasps/import"):
        answer = await api.http.post(path, files=[("name", (None, "bolt"))])
        assert "-F file=@" in refusal(answer, 422, "invalid-request").detail


async def test_files_of_grasps_have_exact_forms_too(api):
    path = f"/v1/objects/{await api.object_id()}/parallel-grasps/import"
    response = await api.http.post(path, files={"file": ("g.json", b"[]")}, data={"formt": "dexnet"})
    assert "'format'" in refusal(response, 422, "invalid-request").detail


async def test_a_file_that_is_sent_as_text_says_how_to_send_it(api):
    plain = await api.http.post("/v1/objects", data={"file": "@part.stl", "unit": "mm"})
    assert "-F file=@" in refusal(plain, 415, "unsupported-media-type").detail
    text = await api.http.post("/v1/objects", files=[("file", (None, "@part.stl"))])
    assert "-F file=@" in refusal(text, 422, "invalid-request").detail


@pytest.mark.parametrize("headers", [{}, {"Content-Type": "application/x-www-form-urlencoded"}])
async def test_json_without_its_media_type_says_which(api, headers):
    for path in ("/v1/jobs", "/v1/batches", "/v1/plan"):
        response = await api.http.post(path, content=b'{"object_id": "x"}', headers=headers)
        assert "application/json" in refusal(response, 415, "unsupported-media-type").detail


async def test_bad_json_says_where(api):
    response = await api.http.post("/v1/jobs", content=b'{"object_id": "x", starts: 3}', headers=JSON)
    assert "at character 19" in refusal(response, 422, "invalid-request").errors[0].detail
    refusal(await api.http.post("/v1/plan", content=b"{", headers=JSON), 422, "invalid-request")


@pytest.mark.parametrize(
    ("body", "field", "hint"),
    [
        ({"object_id": "x", "stars": 3}, "/stars", "'starts'"),
        ({"object_id": "x", "zzz": 3}, "/zzz", "Known: object_id"),
    ],
)
async def test_a_misspelt_field_names_the_right_one(api, body, field, hint):
    for path in ("/v1/jobs", "/v1/plan"):
        (fault,) = refusal(await api.http.post(path, json=body), 422, "invalid-request").errors
        assert fault.field == field
        assert hint in fault.detail
    batch = await api.http.post("/v1/batches", json={"jobs": [body]})
    (fault,) = refusal(batch, 422, "invalid-request").errors
    assert (fault.field, hint in fault.detail) == (f"/jobs/0{field}", True)


async def test_a_state_that_is_none_names_the_states(api):
    (fault,) = refusal(await api.http.get("/v1/jobs?state=done"), 422, "invalid-request").errors
    assert "'succeeded'" in fault.detail


async def test_a_method_that_is_not_taken_names_those_that_are(api):
    response = await api.http.put("/v1/jobs", json={})
    assert response.headers["Allow"] == "GET, HEAD, POST"
    assert "GET, HEAD, POST" in refusal(response, 405, "method-not-allowed").detail


async def test_head_answers_as_get_without_a_body(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    job = f"/v1/jobs/{job_id}"
    for path in ("/healthz", "/readyz", job, f"{job}/grasps/1/picture.png", f"{job}/events", "/review", "/v1/jobs/no"):
        get, head = await api.http.get(path), await api.http.head(path)
        assert (head.status_code, head.content) == (get.status_code, b""), path
        assert head.headers.get("content-type") == get.headers.get("content-type")
        if path != "/healthz" and "content-length" in get.headers:
            assert head.headers["content-length"] == get.headers["content-length"]


async def test_a_body_may_be_compressed(api):
    body = json.dumps({"object_id": await api.object_id(), "hand": FINE}).encode()
    response = await api.http.post("/v1/jobs", content=gzip.compress(body), headers=JSON | {"Content-Encoding": "gzip"})
    assert response.status_code == 202
    bomb = gzip.compress(b" " * 5_000_000)
    assert len(bomb) < 10_000
    response = await api.http.post("/v1/jobs", content=bomb, headers=JSON | {"Content-Encoding": "gzip"})
    assert refusal(response, 413, "too-large").limit == 10_000
    for bad in (body, gzip.compress(body)[:-9]):
        response = await api.http.post("/v1/jobs", content=bad, headers=JSON | {"Content-Encoding": "gzip"})
        refusal(response, 400, "bad-request")
    response = await api.http.post("/v1/jobs", content=body, headers=JSON | {"Content-Encoding": "br"})
    assert "gzip" in refusal(response, 415, "unsupported-media-type").detail


@pytest.mark.parametrize(
    ("sent", "name"),
    [
        ("=?utf-8?B?" + base64.b64encode("w\u00fcrfel.off".encode()).decode() + "?=", "w\u00fcrfel.off"),
        ("UTF-8''w%C3%BCrfel.off", "w\u00fcrfel.off"),
        ("C:\\meshes\\cube.off", "cube.off"),
        ("../../cube.off", "cube.off"),
        ("=?none?B?AAAA?=", ""),
    ],
)
async def test_encoded_file_names_are_read(api, sent, name):
    class File:
        filename = sent

    assert file_name(File()) == name


async def test_a_file_name_with_a_long_suffix_is_no_fault_of_ours(api, cube):
    refusal(await api.upload(cube, "cube." + "x" * 300), 415, "unknown-format")


async def test_a_name_that_is_given_again_counts(api):
    mesh = api.cube(4.5)
    first = await api.upload(mesh, "first.off", unit="cm")
    silent = await api.upload(mesh, "second.off", unit="cm")
    named = await api.upload(mesh, "third.off", unit="cm", name="bolt")
    assert [one.json()["name"] for one in (first, silent, named)] == ["first", "first", "bolt"]
    assert (await api.http.get(first.headers["Location"])).json()["name"] == "bolt"


async def test_the_report_is_that_of_the_file_just_sent(api):
    """The same shape may come of several files: what was done to one is not said of another."""
    tidy = api.cube(3.5)
    spare = tidy.replace(b"8 ", b"9 ", 1).replace(b"\n3 ", b"\n9 9 9\n3 ", 1)  # a vertex that no face has
    reports = []
    for data, unused in ((spare, 1), (tidy, 0), (spare, 1)):
        answer = await api.upload(data, "cube.off", unit="cm")
        assert answer.json()["report"]["unused_vertices"] == unused
        assert (await api.http.get(answer.headers["Location"])).json() == answer.json()
        reports.append(answer.json()["id"])
    assert len(set(reports)) == 1


async def test_pages_of_other_origins_need_a_setting(api, start, tmp_path):
    asks = {"Origin": "https://cell.example", "Access-Control-Request-Method": "POST"}
    assert "access-control-allow-origin" not in (await api.http.options("/v1/jobs", headers=asks)).headers
    async with start(tmp_path, cors_origins=("https://cell.example",)) as open_to_one:
        allowed = await open_to_one.http.options("/v1/jobs", headers=asks)
        assert (allowed.status_code, allowed.headers["access-control-allow-origin"]) == (200, "https://cell.example")
        asks["Origin"] = "https://other.example"
        assert "access-control-allow-origin" not in (await open_to_one.http.options("/v1/jobs", headers=asks)).headers
        posted = await open_to_one.http.post("/v1/jobs", json={}, headers={"Origin": "https://cell.example"})
        assert posted.status_code == 422
        posted = await open_to_one.http.post("/v1/jobs", json={}, headers={"Origin": "https://other.example"})
        assert posted.status_code == 403


async def test_the_root_leads_to_the_pages(api):
    response = await api.http.get("/")
    assert (response.status_code, response.headers["Location"]) == (307, "/review")


async def test_operations_have_the_names_of_methods(api):
    schema = api.app.openapi()
    names = [operation["operationId"] for path in schema["paths"].values() for operation in path.values()]
    assert len(names) == len(set(names))
    assert {"plan_grasps", "get_job", "upload_object", "list_hands"} <= set(names)
    picture = schema["paths"]["/v1/jobs/{job_id}/grasps/{rank}/picture.png"]["get"]["responses"]["200"]
    assert picture["content"]["image/png"]["schema"] == {"type": "string", "format": "binary"}


async def test_one_call_plans_for_a_mesh_in_json(api, cube):
    mesh = {"data": base64.b64encode(cube).decode(), "file_type": "off", "unit": "cm", "name": "die", "mass": 0.2}
    response = await api.http.post("/v1/plan", json={"mesh": mesh, "starts": 5})
    job = Job.model_validate_json(response.content)
    assert (response.status_code, job.state, job.object_name, job.request.starts) == (200, "succeeded", "die", 5)
    assert job.result.grasps
    assert (await api.http.get(response.headers["Location"])).json() == response.json()
    stored = ObjectInfo.model_validate_json((await api.http.get(f"/v1/objects/{job.object_id}")).content)
    assert (stored.name, stored.options.mass) == ("die", 0.2)
    again = await api.http.post("/v1/plan", json={"object_id": job.object_id})
    assert (again.status_code, again.json()["object_id"]) == (200, job.object_id)


async def test_one_call_plans_for_a_file_of_a_form(api, cube):
    fields = {"unit": "cm", "friction": "0.8", "job": json.dumps({"starts": 6})}
    response = await api.http.post("/v1/plan", files={"file": ("my die.off", cube)}, data=fields)
    job = Job.model_validate_json(response.content)
    assert (response.status_code, job.object_name, job.request.starts) == (200, "my die", 6)


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({}, "/mesh"),
        ({"object_id": "x", "mesh": {"data": "AA==", "file_type": "off"}}, "/object_id"),
        ({"mesh": {"data": "%", "file_type": "off"}}, "/mesh/data"),
        ({"mesh": {"data": "AA==", "file_type": "off", "unit": "miles"}}, "/mesh/unit"),
        ({"mesh": {"data": "AA==", "file_type": "off", "mass": 1, "density": 1}}, "/mass"),
        ({"mesh": {"data": "AA==", "file_type": "off"}, "starts": 0}, "/starts"),
        ({"object_id": "unknown"}, "/object_id"),
    ],
)
async def test_one_call_says_what_is_wrong(api, body, field):
    problem = refusal(await api.http.post("/v1/plan", json=body), 422, "invalid-request")
    assert [fault.field for fault in problem.errors] == [field]


async def test_one_call_that_takes_too_long_answers_with_the_job(api):
    api.hold()
    body = {"object_id": await api.object_id(), "hand": "waits"}
    response = await api.http.post("/v1/plan", json=body, headers={"Prefer": "wait=0.1"})
    assert (response.status_code, response.json()["result"]) == (202, None)
    api.go()
    assert (await api.ended(response.json()["id"]))["state"] == "succeeded"


async def test_a_batch_is_cancelled_in_one_call(api):
    api.hold()
    jobs = [{"object_id": await api.object_id(), "hand": "waits"}] * 3
    batch = (await api.http.post("/v1/batches", json={"jobs": jobs}, headers={"Idempotency-Key": "b"})).json()
    again = await api.http.post("/v1/batches", json={"jobs": jobs}, headers={"Idempotency-Key": "b"})
    assert (again.json()["id"], again.headers["Idempotent-Replayed"]) == (batch["id"], "true")
    cancelled = await api.http.post(f"/v1/batches/{batch['id']}/cancel")
    assert cancelled.json()["states"] == {"cancelled": 3}
    assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


@pytest.mark.parametrize(
    ("changes", "field", "said"),
    [
        ({"starts": "many"}, "/starts", 'It must be a whole number. It is "many".'),
        ({"starts": 2.5}, "/starts", "It must be a whole number, without a fraction. It is 2.5."),
        ({"starts": 0}, "/starts", "It must be 1 or more. It is 0."),
        ({"planner": 3}, "/planner", "It must be a JSON object. It is 3."),
        ({"parallel_grasps": []}, "/parallel_grasps", "It must not be empty."),
        ({"strats": 3}, "/strats", "There is no such field. Did you mean 'starts'?"),
    ],
)
async def test_faults_of_fields_are_told_in_plain_sentences(api, changes, field, said):
    response = await api.http.post("/v1/jobs", json={"object_id": await api.object_id()} | changes)
    problem = refusal(response, 422, "invalid-request")
    told = {error.field: error.detail for error in problem.errors}
    assert told[field].startswith(said)
    assert "Input should" not in response.text


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ('{"object_id": "x", "starts": 4, "starts": 8}', "/starts"),
        ('{"object_id": "x", "planner": {"gain": 1, "gain": 2}}', "/planner/gain"),
        ('{"object_id": "x", "scene": {"obstacles": [{"id": "a"}, {"id": "b", "id": "c"}]}}', "/scene/obstacles/1/id"),
    ],
)
async def test_a_repeated_key_of_a_json_body_is_refused(api, body, field):
    problem = refusal(await api.http.post("/v1/jobs", content=body, headers=JSON), 422, "invalid-request")
    assert problem.errors[0].field == field
    assert "more than once" in problem.detail


@pytest.mark.parametrize(
    ("content", "headers", "words"),
    [
        (b"--x\r\n", {"Content-Type": "multipart/form-data"}, "names no boundary"),
        (b"solid", {"Content-Type": "multipart/form-data; boundary=x"}, "no form with the boundary"),
    ],
)
async def test_forms_that_are_none_are_refused_in_own_words(api, content, headers, words):
    problem = refusal(await api.http.post("/v1/objects", content=content, headers=headers), 400, "bad-request")
    assert words in problem.detail


async def test_broken_json_is_refused_in_own_words_and_lists_by_their_name(api):
    response = await api.http.post("/v1/jobs", content=b'{"object_id": "x"', headers=JSON)
    problem = refusal(response, 422, "invalid-request")
    assert problem.errors[0].detail == "The body is not JSON: it breaks off, or breaks the rules at character 17."
    problem = refusal(await api.http.get("/v1/jobs?state=done"), 422, "invalid-request")
    assert problem.errors[0].field == "state"
