"""Clients that others generate from the description of the interface: they compile, and plan."""

import base64
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import httpx2
import pytest

pytestmark = pytest.mark.campaign

WITH_ATTRS = """
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
WITH_PYDANTIC = """
import sys
from generated import ApiClient, Configuration, InlineObject, JobsApi, PlanCreate

jobs = JobsApi(ApiClient(Configuration(host=sys.argv[1])))
mesh = InlineObject(data=open(sys.argv[2]).read(), file_type="off", mass=0.3)
job = jobs.plan_grasps(PlanCreate(mesh=mesh, starts=8, seed=1, top_k=3))
again = jobs.get_job(job.id)
print(again.state, len(again.result.grasps), again.result.grasps[0].palm.position)
"""
WITH_FETCH = """
import { readFileSync } from "node:fs";
import { Configuration, JobsApi } from "./generated/index";

async function main(url: string, file: string): Promise<void> {
  const jobs = new JobsApi(new Configuration({ basePath: url }));
  const mesh = { data: readFileSync(file, "utf8"), fileType: "off", mass: 0.3 };
  const job = await jobs.planGrasps({ planCreate: { mesh, starts: 8, seed: 1, topK: 3 } });
  const again = await jobs.getJob({ jobId: job.id });
  const grasps = again.result!.grasps;
  console.log(again.state, grasps.length, JSON.stringify(grasps[0].palm.position));
}

main(process.argv[2], process.argv[3]);
"""
TYPESCRIPT = ["--strict", "--target", "es2022", "--module", "commonjs", "--types", "node"]
FORMS = ("--global-property", "skipFormModel=false")  # it imports what it does not write otherwise
Install = Callable[..., Path]


@pytest.fixture(scope="module")
def install(tmp_path_factory: pytest.TempPathFactory) -> Install:
    """Puts packages into an environment of its own, since generators want other versions of some; its programs."""
    environment = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", environment], check=True, timeout=300)

    def install(*packages: str) -> Path:
        subprocess.run([environment / "bin" / "pip", "install", "-q", *packages], check=True, timeout=600)
        return environment / "bin"

    return install


@pytest.fixture
def place(service: str, can: bytes, tmp_path: Path) -> Path:
    """A folder with the description of the interface, and the file of a mesh as base64."""
    (tmp_path / "openapi.json").write_bytes(httpx2.get(f"{service}/openapi.json", timeout=60).content)
    (tmp_path / "mesh.txt").write_bytes(base64.b64encode(can))
    return tmp_path


def generate(programs: Path, place: Path, language: str, *options: str) -> None:
    """A client by openapi-generator, which refuses what it finds wrong with the description."""
    if shutil.which("java") is None:
        pytest.skip("openapi-generator needs Java")
    program = [programs / "openapi-generator-cli", "generate", "-i", place / "openapi.json", "-g", language]
    done = subprocess.run([*program, *options], cwd=place, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]


def plans(command: list[str | Path], service: str, place: Path) -> None:
    done = subprocess.run(
        [*command, service, place / "mesh.txt"], cwd=place, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("succeeded 3 [")


def test_openapi_python_client_compiles_and_plans(service: str, install: Install, place: Path) -> None:
    programs = install("openapi-python-client")
    options = ["--path", place / "openapi.json", "--output-path", place / "generated", "--meta", "none"]
    subprocess.run([programs / "openapi-python-client", "generate", *options], check=True, timeout=300)
    subprocess.run([programs / "python", "-m", "compileall", "-q", place / "generated"], check=True, timeout=300)
    (place / "plan.py").write_text(WITH_ATTRS)
    plans([programs / "python", place / "plan.py"], service, place)


def test_openapi_generators_python_compiles_and_plans(service: str, install: Install, place: Path) -> None:
    programs = install("openapi-generator-cli")
    generate(programs, place, "python", "-o", "made", "--additional-properties", "packageName=generated")
    install("-r", str(place / "made" / "requirements.txt"))
    shutil.move(place / "made" / "generated", place)
    subprocess.run([programs / "python", "-m", "compileall", "-q", place / "generated"], check=True, timeout=300)
    (place / "plan.py").write_text(WITH_PYDANTIC)
    plans([programs / "python", place / "plan.py"], service, place)


def test_openapi_generators_typescript_compiles_and_plans(service: str, install: Install, place: Path) -> None:
    if shutil.which("npm") is None:
        pytest.skip("TypeScript needs npm")
    generate(install("openapi-generator-cli"), place, "typescript-fetch", "-o", "generated", *FORMS)
    packages = ["typescript@5", "@types/node@20"]
    subprocess.run(["npm", "install", "--silent", "--no-fund", *packages], cwd=place, check=True, timeout=600)
    (place / "plan.ts").write_text(WITH_FETCH)
    compiler = [place / "node_modules" / ".bin" / "tsc", *TYPESCRIPT, "--outDir", "js", "plan.ts"]
    done = subprocess.run(compiler, cwd=place, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout
    plans(["node", place / "js" / "plan.js"], service, place)
