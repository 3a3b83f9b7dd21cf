"""Clients that others generate from the description of the interface: they compile, and plan."""

import base64
import subprocess
import sys
from pathlib import Path

import httpx2
import pytest

PLAN = """
import sys
from generated import Client
from generated.api.jobs import get_job, plan_grasps
from generated.models import InlineObject, PlanCreate

client = Client(base_url=sys.argv[1], raise_on_unexpected_status=True, timeout=300)
mesh = InlineObject(data=open(sys.argv[2]).read(), file_type="off", mass=0.3)
job = plan_grasps.sync(client=client, body=PlanCreate(mesh=mesh, starts=8, seed=1, top_k=3))
again = get_job.sync(job.id, client=client)
print(again.state, len(again.result.grasps), again.result.grasps[0].palm.position)
"""


@pytest.mark.campaign
def test_openapi_python_client_compiles_and_plans(service: str, can: bytes, tmp_path: Path) -> None:
    """In an environment of its own, since the generator wants other versions of some packages."""
    environment = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", environment], check=True, timeout=300)
    programs = environment / "bin"
    subprocess.run([programs / "pip", "install", "-q", "openapi-python-client"], check=True, timeout=600)
    (tmp_path / "openapi.json").write_bytes(httpx2.get(f"{service}/openapi.json", timeout=60).content)
    options = ["--path", tmp_path / "openapi.json", "--output-path", tmp_path / "generated", "--meta", "none"]
    subprocess.run([programs / "openapi-python-client", "generate", *options], check=True, timeout=300)
    subprocess.run([programs / "python", "-m", "compileall", "-q", tmp_path / "generated"], check=True, timeout=300)
    (tmp_path / "mesh.txt").write_bytes(base64.b64encode(can))
    (tmp_path / "plan.py").write_text(PLAN)
    command = [programs / "python", tmp_path / "plan.py", service, tmp_path / "mesh.txt"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("succeeded 3 [")
