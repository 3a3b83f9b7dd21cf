"""The commands of the client's distribution, in processes of their own against the real service."""

import json
import pkgutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import get_args

import pytest

from fingersplit_client import Client, JobCreate, commands
from fingersplit_client.commands.jobs import State
from fingersplit_client.commands.program import main
from fingersplit_client.schemas import JobState
from in_process import run_program

NAMES = {"cancel", "grasps", "jobs", "mcp", "outcome", "outcomes", "submit", "watch"}


def run(*arguments: object, code: int = 0, server: str = "") -> "subprocess.CompletedProcess[str]":
    program = [sys.executable, "-c", "from fingersplit_client.commands.program import main; main()"]
    where = ["--server", server] if server else []
    done = subprocess.run(
        [*program, *map(str, arguments), *where], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == code, done.stderr
    return done


def test_every_command_is_an_entry_point() -> None:
    pyproject = tomllib.loads((Path(__file__).parents[2] / "clients" / "python" / "pyproject.toml").read_text())
    entries = pyproject["project"]["entry-points"]["fingersplit.commands"]
    assert entries == {name: f"fingersplit_client.commands.{name}:{name}" for name in NAMES}
    assert {module.name for module in pkgutil.iter_modules(commands.__path__)} >= NAMES
    assert all(name in run("--help").stdout for name in NAMES)
    assert get_args(JobState) == tuple(State)


def test_the_way_from_a_mesh_to_a_file(service: str, can: bytes, tmp_path: Path) -> None:
    mesh = tmp_path / "can.off"
    mesh.write_bytes(can)
    job = run("submit", mesh, "--starts", 8, "--mass", 0.3, "--option", "top_k=3", server=service).stdout.strip()
    watched = run("watch", job, server=service)
    assert "starts ended in a feasible grasp" in watched.stdout
    assert f"{job}  succeeded" in watched.stderr
    files = [tmp_path / name for name in ("can.json", "can.png", "grasps.json")]
    told = run("grasps", job, "--json", files[0], "--picture", files[1], "--export", files[2], server=service).stdout
    assert "P holds" in told
    assert "margin [N]" in told
    assert all(f"to {file}" in told for file in files)
    assert len(json.loads(files[0].read_text())["grasps"]) == 3
    assert files[1].read_bytes().startswith(b"\x89PNG")
    assert len(json.loads(files[2].read_text())["grasps"]) == 3
    assert "dropped" in run("outcome", job, 1, "--dropped", "--note", "slid", server=service).stdout
    listed = run("outcomes", "--job", job, "--export", tmp_path / "outcomes.csv", server=service).stdout
    assert "0 of 1 held." in listed
    assert "slid" in listed
    assert (tmp_path / "outcomes.csv").read_text().count("\n") == 2
    assert job in run("jobs", "--name", "can", "--state", "succeeded", server=service).stdout


def test_a_job_is_cancelled(service: str, can: bytes) -> None:
    with Client(service) as client:
        uploaded = client.objects.upload(can, file_type="off")
        job = client.jobs.create(JobCreate(object_id=uploaded.id, starts=4096))
    assert run("cancel", job.id, server=service).stdout == f"{job.id}  cancelled\n"
    assert "cancelled" in run("watch", job.id, server=service, code=1).stdout
    assert "has no result" in run("grasps", job.id, server=service, code=2).stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("submit", __file__, "--option", "strats=3"), "Error: There is no option 'strats'; did you mean 'starts'?"),
        (("submit", __file__, "--option", "strats"), "must be NAME=VALUE"),
        (("submit", __file__, "--mass", "-1"), "mass: It must be 1e-06 or more. It is -1.0."),
        (("submit", __file__, "--option", "planner=3"), "planner: It must be names with values. It is 3."),
        (("submit", "none.ply"), "does not exist"),
        (("jobs", "--state", "done"), "is not one of"),
        (("grasps", "j", "--json", "nowhere/x.json"), "the folder nowhere does not exist"),
        (("jobs",), "Error: No answer from"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(
    arguments: tuple[str, ...], message: str, unused_url: str, tmp_path: Path
) -> None:
    ended = run_program(*arguments, "--server", unused_url, cwd=tmp_path, program=main)
    told = ended.stderr
    assert ended.returncode == 2
    assert message in " ".join(told.replace("\u2502", " ").split())
    assert "Traceback" not in told
