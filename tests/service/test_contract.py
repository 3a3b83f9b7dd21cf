"""The description of the interface against the service, with requests that schemathesis makes up."""

import itertools
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import httpx2
import pytest
from test_faults import serving

CHECKS = ["not_a_server_error", "status_code_conformance", "content_type_conformance", "response_schema_conformance"]


HOOKS = "schemathesis_hooks"
ALONE = ("--exclude-path-regex", "^/v1/datasets")
"""Data sets queue jobs by themselves; their tests say in which order."""


def check(http: httpx2.Client, folder: Path, cube: bytes, examples: int) -> int:
    """Send requests that the description allows, and some that it forbids; how many were sent."""
    object_id = http.post("/v1/objects", files={"file": ("c.off", cube)}, data={"unit": "cm"}).json()["id"]
    job = http.post("/v1/jobs", json={"object_id": object_id}, headers={"Prefer": "wait=20"}).json()
    hand = http.post("/v1/hands", files={"file": ("hand.zip", b"PK\x05\x06" + 18 * b"\0")}).json()
    ids = {"path.hand_id": hand["name"], "path.object_id": object_id, "path.job_id": job["id"], "path.rank": 1}
    lines = [f"{json.dumps(name)} = {json.dumps(value)}" for name, value in ids.items()]
    keep = [  # what the other operations are asked about is not deleted
        f'[[operations]]\ninclude-name = "DELETE {path}"\nparameters = {{ {name} = "unknown" }}\n'
        for path, name in (
            ("/v1/objects/{object_id}", '"path.object_id"'),
            ("/v1/jobs/{job_id}", '"path.job_id"'),
            ("/v1/hands/{hand_id}", '"path.hand_id"'),
        )
    ]
    (folder / "schemathesis.toml").write_text("\n".join(["[parameters]", *lines, *keep]))
    return number("generated", run(http, folder, examples, "examples,coverage,fuzzing", 1))


def check_sequences(http: httpx2.Client, folder: Path, least: int) -> int:
    """Make things and use, change and delete them, as the links say, with at least so many requests; links followed."""
    shutil.copy(Path(__file__).with_name(f"{HOOKS}.py"), folder)
    sent, links, seeds = 0, 0, itertools.count(1)
    while sent < least:
        said = run(http, folder, 60, "stateful", next(seeds), *ALONE, SCHEMATHESIS_HOOKS=HOOKS)
        sent += number("generated", said)
        links = max(links, number("covered", said))
    return links


def run(
    http: httpx2.Client, folder: Path, examples: int, phases: str, seed: int, *further: str, **environment: str
) -> str:
    """What schemathesis says after it has found nothing wrong."""
    url = str(http.base_url).rstrip("/")
    program = [sys.executable, "-m", "schemathesis.cli", "run", f"{url}/openapi.json", "--url", url]
    options = ["--checks", ",".join(CHECKS), "--phases", phases, "--max-examples", str(examples), "--seed", str(seed)]
    limits = ["--request-timeout", "30", "--suppress-health-check", "all", "--no-color"]
    ended = subprocess.run(
        [*program, *options, *limits, *further],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout[-6000:] + ended.stderr[-2000:]
    return ended.stdout


def number(of: str, said: str) -> int:
    """The number that stands before a word."""
    found = re.search(rf"(\d+) {of}", said)
    assert found, said[-2000:]
    return int(found[1])


def test_no_request_meets_a_fault_or_an_undocumented_answer(tmp_path, unused_port, cube):
    with serving(tmp_path / "data", unused_port) as (process, http):
        assert check(http, tmp_path, cube, 1) > 500
        assert process.poll() is None


def test_sequences_of_requests_meet_no_fault(tmp_path, unused_port):
    with serving(tmp_path / "data", unused_port) as (process, http):
        assert check_sequences(http, tmp_path, 100) > 7
        assert re.search(r'jobs_ended_total\{state="succeeded"\} [1-9]', http.get("/metrics").text)
        assert process.poll() is None


@pytest.mark.campaign
def test_ten_thousand_requests_meet_no_fault(tmp_path, unused_port, cube):
    with serving(tmp_path / "data", unused_port) as (process, http):
        assert check(http, tmp_path, cube, 320) > 9_000
        assert process.poll() is None


@pytest.mark.campaign
def test_ten_thousand_requests_in_sequences_meet_no_fault(tmp_path, unused_port):
    with serving(tmp_path / "data", unused_port) as (process, http):
        assert check_sequences(http, tmp_path, 10_000) > 15
        assert process.poll() is None
