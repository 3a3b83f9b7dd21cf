"""The review pages, views of grasps and the viewer as they are served; what they do in a browser is tested there."""

import gzip
import re
import subprocess
import sys

import pytest
from fake_workers import FINE, NO_GRASP, WAITS

from fingersplit_client.schemas import GraspCurve, Problem

pytestmark = pytest.mark.anyio

PAGES = ("/review", "/review/new", "/review/runs/anything", "/review/compare", "/review/login")


@pytest.mark.parametrize("path", PAGES)
async def test_pages_allow_nothing_but_their_own_origin(api, path):
    page = await api.http.get(path)
    assert page.status_code == 200
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    policy = dict(part.strip().split(" ", 1) for part in page.headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'none'"
    assert set(" ".join(policy.values()).split()) <= {"'none'", "'self'"}
    assert page.headers["x-frame-options"] == "DENY"
    assert "style=" not in page.text
    assert not re.search(r"(?:src|href)=\"(?!/|#main)", page.text)


@pytest.mark.parametrize("path", PAGES)
async def test_everything_that_a_page_names_is_there(api, path):
    waiting, seen = re.findall(r"(?:src|href)=\"(/review/site/[^\"]+)\"", (await api.http.get(path)).text), set()
    while waiting:
        address = waiting.pop()
        if address in seen:
            continue
        seen.add(address)
        file = await api.http.get(address)
        assert file.status_code == 200, address
        waiting += [f"/review/site/{name}" for name in re.findall(r"from \"\./([\w.]+)\"", file.text)]
    assert {"/review/site/style.css", "/review/site/mark.svg"} <= seen
    assert sum(name.endswith(".js") for name in seen) >= 3


async def test_a_browser_that_has_a_file_is_not_sent_it_again(api):
    first = await api.http.get("/review/site/list.js")
    again = await api.http.get("/review/site/list.js", headers={"If-None-Match": first.headers["etag"]})
    assert first.headers["content-type"] == "text/javascript; charset=utf-8"
    assert (again.status_code, again.content) == (304, b"")
    page = await api.http.get("/review")
    assert (await api.http.get("/review", headers={"If-None-Match": page.headers["etag"]})).status_code == 304


async def test_an_address_that_is_none_is_a_page_for_people_and_a_problem_for_programs(api):
    page = await api.http.get("/review/nothing", headers={"Accept": "text/html,*/*;q=0.8"})
    assert (page.status_code, page.headers["content-type"]) == (404, "text/html; charset=utf-8")
    again = await api.http.get(
        "/review/nothing", headers={"Accept": "text/html", "If-None-Match": page.headers["etag"]}
    )
    assert again.status_code == 404
    answer = await api.http.get("/review/nothing")
    assert Problem.model_validate_json(answer.content).status == 404


@pytest.mark.parametrize(
    ("asked", "page"),
    [
        ("/review/", "/review"),
        ("/review/hands/", "/review/hands"),
        ("/review/runs/x/?grasp=3", "/review/runs/x?grasp=3"),
    ],
)
async def test_a_slash_at_the_end_leads_to_the_page(api, asked, page):
    moved = await api.http.get(asked, headers={"Accept": "text/html"})
    assert (moved.status_code, moved.headers["location"]) == (307, page)
    assert (await api.http.get(page)).status_code == 200


@pytest.mark.parametrize("name", ["nothing.js", "..%2Fpages.py", "list.html", "%2e%2e"])
async def test_there_are_no_other_files(api, name):
    answer = await api.http.get(f"/review/site/{name}")
    assert answer.status_code == 404
    assert Problem.model_validate_json(answer.content).status == 404


async def test_the_viewer_stands_in_a_frame_of_our_own_pages_only(api):
    page = await api.http.get("/review/viewer")
    assert page.headers["x-frame-options"] == "SAMEORIGIN"
    policy = page.headers["content-security-policy"]
    assert "connect-src 'self'" in policy
    assert "frame-ancestors 'self'" in policy
    assert "script-src 'self' 'wasm-unsafe-eval'" in policy
    assert "{version}" not in page.text


async def test_the_viewer_is_the_build_of_the_installed_package(api, monkeypatch, tmp_path):
    monkeypatch.setenv("FINGERSPLIT_VIEWER_DIR", str(tmp_path))
    files = re.search(r"data-files=\"([^\"]+)\"", (await api.http.get("/review/viewer")).text)[1]
    script = await api.http.get(f"{files}/re_viewer.js")  # sets everything up
    assert script.headers["content-encoding"] == "gzip"
    assert "immutable" in script.headers["cache-control"]
    assert "wasm_bindgen" in script.text
    program = await api.http.get(f"{files}/re_viewer_bg.wasm")
    assert program.headers["content-type"] == "application/wasm"
    assert program.content[:4] == b"\0asm"
    assert int(program.headers["content-length"]) < 0.5 * len(program.content)
    (kept,) = tmp_path.iterdir()
    assert gzip.decompress((kept / "re_viewer_bg.wasm.gz").read_bytes()) == program.content
    for address in (f"{files}/index.html", "/review/viewer/rerun-viewer-0.0.1/re_viewer.js"):
        assert (await api.http.get(address)).status_code == 404


@pytest.mark.parametrize(
    ("path", "media_type"),
    [
        ("grasps/1/recording.rrd", "application/vnd.rerun.rrd"),
        ("recording.rrd", "application/vnd.rerun.rrd"),
        ("grasps/1/animation.webp", "image/webp"),
        ("thumbnail.webp", "image/webp"),
    ],
)
async def test_views_are_made_when_asked_for_and_kept(api, path, media_type):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    name = path.rpartition("/")[2]
    kept = api.storage.view(job_id, 1, name)
    assert not kept.exists()
    view = await api.http.get(f"/v1/jobs/{job_id}/{path}")
    assert (view.status_code, view.content) == (200, name.encode())
    assert view.headers["content-type"] == media_type
    assert view.headers["cache-control"].startswith("private")
    kept.write_bytes(b"kept")
    assert (await api.http.get(f"/v1/jobs/{job_id}/{path}")).content == b"kept"


async def test_views_of_what_is_not_there(api):
    object_id = await api.object_id()
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    assert (await api.http.get(f"/v1/jobs/{job_id}/grasps/2/recording.rrd")).status_code == 404
    assert (await api.http.get("/v1/jobs/nothing/thumbnail.webp")).status_code == 404
    api.storage.shape(object_id).rename(api.data_dir / "elsewhere")
    gone = await api.http.get(f"/v1/jobs/{job_id}/recording.rrd")
    (api.data_dir / "elsewhere").rename(api.storage.shape(object_id))
    assert Problem.model_validate_json(gone.content).type == "urn:fingersplit:problem:gone"


async def test_views_of_a_running_job_are_not_finished(api):
    api.hold()
    job_id = await api.queue(WAITS)
    try:
        answer = await api.http.get(f"/v1/jobs/{job_id}/thumbnail.webp")
        assert Problem.model_validate_json(answer.content).type == "urn:fingersplit:problem:not-finished"
    finally:
        await api.http.post(f"/v1/jobs/{job_id}/cancel")


async def test_deleting_a_run_deletes_its_views(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    await api.http.get(f"/v1/jobs/{job_id}/recording.rrd")
    folder = api.storage.job_folder(job_id)
    assert [file.name for file in folder.iterdir()] == ["grasp-1-recording.rrd"]
    assert (await api.http.delete(f"/v1/jobs/{job_id}")).status_code == 204
    assert not folder.exists()


async def test_the_curve_has_a_value_for_every_state(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    curve = GraspCurve.model_validate_json((await api.http.get(f"/v1/jobs/{job_id}/grasps/1/curve")).content)
    assert curve.phases == ["map", "cpo"]
    assert curve.quality == [0.1, 0.2]
    assert curve.residual == [1e-3, 2e-3]


async def test_runs_are_found_by_a_part_of_the_objects_name(api):
    upload = await api.upload(api.cube(7.5), "seven.off", unit="cm", name="Blue 100% box_1")
    for _ in range(2):
        body = {"object_id": upload.json()["id"], "hand": NO_GRASP}
        assert (await api.http.post("/v1/jobs", json=body)).status_code == 202
    for part, count in (("blue", 2), ("00% BOX_", 2), ("100_", 0), ("%", 2), ("green", 0)):
        found = (await api.http.get("/v1/jobs", params={"object_name": part})).json()["items"]
        assert len(found) == count, part
        assert all(job["object_name"] == "Blue 100% box_1" for job in found)


def test_the_service_itself_loads_no_rerun():
    code = "import sys, fingersplit_service.app; sys.exit('rerun' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0


async def test_results_are_exported_in_every_format(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    exported = await api.http.get(f"/v1/jobs/{job_id}/export/moveit", params={"rank": 1})
    assert (exported.status_code, exported.json()) == (200, {"format": "moveit", "rank": 1})
    assert exported.headers["content-disposition"] == f'attachment; filename="{job_id}-moveit.json"'
    assert (await api.http.get(f"/v1/jobs/{job_id}/export/pickle")).status_code == 422
    assert (await api.http.get("/v1/jobs/nothing/export/moveit")).status_code == 404
