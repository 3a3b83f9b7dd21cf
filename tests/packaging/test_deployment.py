"""What deploys the service is what its tools take: compose file, chart, and a Dockerfile whose files are there."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

REPOSITORY = Path(__file__).parents[2]
CHART = REPOSITORY / "deploy" / "helm" / "fingersplit"


def settings_in(text: str) -> set[str]:
    return set(re.findall(r"FINGERSPLIT_([A-Z_]+[A-Z])\b", text))


def test_every_setting_that_is_deployed_is_one():
    from fingersplit_service.settings import ServiceSettings

    known = {name.upper() for name in ServiceSettings.model_fields} | {"VIEWER_DIR"}
    files = [REPOSITORY / "compose.yaml", REPOSITORY / "Dockerfile", *CHART.rglob("*.yaml"), *CHART.rglob("*.tpl")]
    for file in [*files, REPOSITORY / "docs" / "scaling.md"]:
        assert settings_in(file.read_text()) <= known, file


def test_the_compose_file_is_one():
    pytest.importorskip("check_jsonschema")
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec"]
    checked = subprocess.run(
        [*command, str(REPOSITORY / "compose.yaml")], capture_output=True, text=True, timeout=120, check=False
    )
    assert checked.returncode == 0, checked.stdout
    services = yaml.safe_load((REPOSITORY / "compose.yaml").read_text())["services"]
    assert services["serve"]["deploy"]["replicas"] == 2
    assert services["worker"]["command"] == ["fingersplit", "worker"]


@pytest.fixture(scope="module")
def rendered() -> dict[str, dict]:
    """The chart's documents by kind and name."""
    chart = pytest.importorskip("helm_python").chart
    documents = {}
    with chart.Chart.load(str(CHART)) as loaded:
        for name, text in loaded.render(name="demo").items():
            if name.endswith(".yaml"):
                for one in yaml.safe_load_all(text):
                    if one:
                        documents[f"{one['kind']} {one['metadata']['name']}"] = one
    return documents


def test_the_chart_passes_its_linter():
    chart = pytest.importorskip("helm_python").chart
    messages = chart.lint(str(CHART))["messages"]
    assert [one for one in messages if "icon" not in str(one).lower()] == []


def test_what_the_chart_makes_is_what_kubernetes_takes(rendered):
    validate = pytest.importorskip("kubernetes_validate").validate
    for document in rendered.values():
        if not document["apiVersion"].startswith("keda.sh"):
            validate(document, "1.31", strict=True)


def test_pods_have_few_rights_and_are_watched(rendered):
    for name in ("serve", "worker"):
        pod = rendered[f"Deployment demo-fingersplit-{name}"]["spec"]["template"]["spec"]
        assert pod["securityContext"]["runAsNonRoot"] is True
        for container in (*pod["containers"], *pod["initContainers"]):
            context = container["securityContext"]
            assert (context["readOnlyRootFilesystem"], context["allowPrivilegeEscalation"]) == (True, False)
            assert {"cpu", "memory"} <= set(container["resources"]["requests"])
        (container,) = pod["containers"]
        assert container["readinessProbe"]["httpGet"]["path"] == "/readyz"
        assert container["livenessProbe"]["httpGet"]["path"] == "/healthz"
        given = {one["name"]: one.get("value") for one in container["env"]}
        grace = float(given.get("FINGERSPLIT_STOP_GRACE_S") or given.get("FINGERSPLIT_DRAIN_S"))
        assert pod["terminationGracePeriodSeconds"] > grace


def test_workers_scale_with_the_jobs_of_the_table(rendered):
    scaled = rendered["ScaledObject demo-fingersplit-worker"]["spec"]
    assert scaled["scaleTargetRef"]["name"] == "demo-fingersplit-worker"
    (trigger,) = scaled["triggers"]
    assert trigger["type"] == "postgresql"
    assert "FROM jobs" in trigger["metadata"]["query"]
    assert "replicas" not in rendered["Deployment demo-fingersplit-worker"]["spec"]


def test_every_file_that_the_image_copies_is_there_and_not_ignored():
    allowed = [line[1:] for line in (REPOSITORY / ".dockerignore").read_text().splitlines() if line.startswith("!")]
    for line in (REPOSITORY / "Dockerfile").read_text().splitlines():
        if line.startswith("COPY ") and "--from" not in line:
            source = line.split()[1]
            assert (REPOSITORY / source).exists(), line
            assert any(source == one or source.startswith(f"{one}/") for one in allowed), line
