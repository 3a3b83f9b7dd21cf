"""Blocks of the documentation that talk to a service, against a real one."""

import json
import subprocess
from pathlib import Path

import pytest

from code_blocks import ROOT, blocks, commands

URL = "http://127.0.0.1:8000"
BLOCKS = [one for one in blocks("python") if "fingersplit_client" in one.text]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (tmp_path / "mug.ply").symlink_to(ROOT / "examples" / "objects" / "mug.ply")
    monkeypatch.chdir(tmp_path)
    (image,) = [one for one in blocks("python") if "depth.png" in one.text and one not in BLOCKS]
    exec(compile(image.text, str(image), "exec"), {})
    (scene,) = [one for one in blocks("json") if one.page == "docs/failed_run.md"]
    Path("shelf.json").write_text(scene.text)
    return tmp_path


@pytest.mark.parametrize("block", BLOCKS, ids=str)
def test_the_python_runs(block, place: Path, service: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert URL in block.text
    exec(compile(block.text.replace(URL, service), str(block), "exec"), {})
    assert capsys.readouterr().out


def test_the_calls_of_curl_answer(place: Path, service: str) -> None:
    ids = {"OBJECT_ID": "", "JOB_ID": ""}
    for where, words in commands("curl"):
        given = [word.replace(URL, service) for word in words]
        for name, value in ids.items():
            given = [word.replace(name, value) for word in given]
        done = subprocess.run([*given, "--silent", "--fail-with-body"], capture_output=True, timeout=300, check=False)
        assert done.returncode == 0, f"{where}: {done.stdout.decode()}"
        if done.stdout:
            answer = json.loads(done.stdout)
            if "state" in answer:
                ids["JOB_ID"] = answer["id"]
                waiting = ["curl", "--silent", "-H", "Prefer: wait=60", f"{service}/v1/jobs/{answer['id']}"]
                ended = json.loads(subprocess.run(waiting, capture_output=True, timeout=300, check=True).stdout)
                assert ended["state"] == "succeeded", where
            elif "id" in answer:
                ids["OBJECT_ID"] = answer["id"]
