"""What robots report of planned grasps is kept, listed, exported and compared with what was predicted."""

import csv
import io
import json

import pytest
from fake_workers import FINE, WAITS

from fingersplit_client.schemas import GraspOutcome, OutcomePage, OutcomeSummary

pytestmark = pytest.mark.anyio

ERROR = {"position": [0.002, 0.0, -0.001], "wxyz": [2.0, 0.0, 0.0, 0.0]}


async def report(api, job_id: str, rank: int = 1, **body: object):
    return await api.http.post(f"/v1/jobs/{job_id}/grasps/{rank}/outcome", json=body)


async def test_an_outcome_is_kept_beside_what_was_predicted(api):
    job = await api.ended(await api.queue(FINE))
    response = await report(api, job["id"], held=False, pose_error=ERROR, note="slid off")
    assert response.status_code == 201, response.text
    outcome = GraspOutcome.model_validate_json(response.content)
    assert (outcome.held, outcome.note, outcome.rank, outcome.hand) == (False, "slid off", 1, FINE)
    assert (outcome.p_hold, outcome.p_hold_tier) == (0.8, "estimated")
    assert outcome.pose_error is not None
    assert outcome.pose_error.wxyz == (1.0, 0.0, 0.0, 0.0)
    again = GraspOutcome.model_validate_json((await report(api, job["id"], held=True)).content)
    listed = (await api.http.get(f"/v1/jobs/{job['id']}/grasps/1/outcomes")).json()
    assert [one["id"] for one in listed] == [again.id, outcome.id]
    assert (await api.http.get(f"/v1/jobs/{job['id']}/grasps/2/outcomes")).json() == []


async def test_lists_are_paged_and_filtered(api):
    first, second = [await api.ended(await api.queue(FINE)) for _ in range(2)]
    kept = [(await report(api, job["id"], held=True)).json()["id"] for job in (first, second, first)]
    of_first = {"job_id": first["id"], "limit": 1}
    page = OutcomePage.model_validate_json((await api.http.get("/v1/outcomes", params=of_first)).content)
    assert [one.id for one in page.items] == [kept[2]]
    rest = await api.http.get("/v1/outcomes", params=of_first | {"cursor": page.next_cursor})
    assert [one["id"] for one in rest.json()["items"]] == [kept[0]]
    assert (await api.http.get("/v1/outcomes", params={"hand": "nobody's"})).json()["items"] == []


async def test_predictions_are_compared_with_what_happened(api):
    job = await api.ended(await api.queue(FINE))
    for held in (True, True, True, False):
        await report(api, job["id"], held=held)
    response = await api.http.get("/v1/outcomes/summary", params={"job_id": job["id"]})
    summary = OutcomeSummary.model_validate_json(response.content)
    assert (summary.outcomes, summary.held, summary.predicted) == (4, 3, 4)
    assert summary.brier_score == pytest.approx((3 * 0.2**2 + 0.8**2) / 4)
    assert summary.calibration_error == pytest.approx(0.05)
    (filled,) = [one for one in summary.bins if one.outcomes]
    assert (filled.low, filled.predicted, filled.held) == (0.8, pytest.approx(0.8), 0.75)
    nothing = (await api.http.get("/v1/outcomes/summary", params={"hand": "nobody's"})).json()
    assert (nothing["outcomes"], nothing["brier_score"], nothing["calibration_error"]) == (0, None, None)


async def test_outcomes_are_exported_with_the_planned_grasp(api):
    job = await api.ended(await api.queue(FINE))
    await report(api, job["id"], held=True, note="=1+1, fine")
    await report(api, job["id"], held=False, pose_error=ERROR)
    of_job = {"job_id": job["id"]}
    lines = (await api.http.get("/v1/outcomes/export", params=of_job)).text.splitlines()
    planned = job["result"]["grasps"][0]
    assert [json.loads(line)["held"] for line in lines] == [False, True]
    assert json.loads(lines[0])["grasp"]["palm"] == planned["palm"]
    table = await api.http.get("/v1/outcomes/export", params=of_job | {"file_format": "csv"})
    assert table.headers["Content-Type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(table.text)))
    assert [row["note"] for row in rows] == ["", "'=1+1, fine"]
    assert float(rows[0]["error_z"]) == -0.001
    assert rows[1]["error_z"] == ""
    assert (await api.http.get("/v1/outcomes/export", params={"file_format": "xls"})).status_code == 422


async def test_outcomes_outlive_their_job_and_can_be_deleted(api):
    job = await api.ended(await api.queue(FINE))
    kept = (await report(api, job["id"], held=True)).json()
    assert (await api.http.delete(f"/v1/jobs/{job['id']}")).status_code == 204
    assert (await api.http.get(f"/v1/jobs/{job['id']}/grasps/1/outcomes")).json() == [kept]
    assert (await api.http.delete(f"/v1/outcomes/{kept['id']}")).status_code == 204
    assert (await api.http.get(f"/v1/jobs/{job['id']}/grasps/1/outcomes")).status_code == 404
    assert (await api.http.delete(f"/v1/outcomes/{kept['id']}")).status_code == 404


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"held": "perhaps"},
        {"held": True, "pose_error": {"position": [0, 0]}},
        {"held": True, "pose_error": {"position": [0, 0, 0], "wxyz": [0, 0, 0, 0]}},
        {"held": True, "note": 2001 * "x"},
        {"held": True, "unknown": 1},
    ],
)
async def test_what_is_no_outcome_is_refused(api, body):
    job = await api.ended(await api.queue(FINE))
    refused = await report(api, job["id"], **body)
    assert refused.status_code == 422
    assert refused.json()["errors"]


async def test_only_grasps_that_there_are_have_outcomes(api):
    job = await api.ended(await api.queue(FINE))
    assert (await report(api, job["id"], rank=9, held=True)).status_code == 404
    assert (await report(api, "nothing", held=True)).status_code == 404
    api.hold()
    waiting = await api.queue(WAITS)
    assert (await report(api, waiting, held=True)).status_code == 409
    api.go()
    await api.ended(waiting)
