"""The description of the interface against the service, with requests that schemathesis makes up."""

import subprocess
import sys
from pathlib import Path

import pytest
from test_faults import serving

CHECKS = ["not_a_server_error", "status_code_conformance", "content_type_conformance", "response_schema_conformance"]


def check(url: str, report: Path, examples: int, phases: str) -> subprocess.CompletedProcess[str]:
    program = [sys.executable, "-m", "schemathesis.cli", "run", f"{url}/openapi.json", "--url", url]
    options = ["--checks", ",".join(CHECKS), "--phases", phases, "--max-examples", str(examples), "--seed", "1"]
    limits = ["--request-timeout", "30", "--suppress-health-check", "all", "--no-color"]
    return subprocess.run([*program, *options, *limits], cwd=report, capture_output=True, text=True, check=False)


def test_no_request_meets_a_fault_or_an_undocumented_answer(tmp_path, unused_port):
    with serving(tmp_path / "data", unused_port) as (process, _):
        ended = check(f"http://127.0.0.1:{unused_port}", tmp_path, 15, "examples,coverage,fuzzing")
        assert ended.returncode == 0, ended.stdout[-6000:] + ended.stderr[-2000:]
        assert process.poll() is None


@pytest.mark.campaign
def test_ten_thousand_requests_in_sequences_meet_no_fault(tmp_path, unused_port):
    with serving(tmp_path / "data", unused_port) as (process, _):
        ended = check(f"http://127.0.0.1:{unused_port}", tmp_path, 400, "examples,coverage,fuzzing,stateful")
        assert ended.returncode == 0, ended.stdout[-6000:] + ended.stderr[-2000:]
        assert process.poll() is None
