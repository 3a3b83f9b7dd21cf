"""The description of the interface, and the shape of every refusal."""

import re
from dataclasses import MISSING, fields
from types import NoneType
from typing import get_args, get_type_hints

import fastapi
import httpx2
import numpy as np
import pytest
from fake_workers import FUNCTIONS
from pydantic import ValidationError

from fingersplit.objects.intake.report import CloudReport as CoreCloudReport
from fingersplit.objects.intake.report import IntakeReport as CoreIntakeReport
from fingersplit.objects.options import ObjectOptions as CoreOptions
from fingersplit.objects.solid import VolumeMethod
from fingersplit.objects.source import UNITS
from fingersplit.objects.source import ObjectSource as CoreSource
from fingersplit.splitting.settings import PlannerSettings
from fingersplit_client.schemas import (
    CloudReport,
    ControllerInfo,
    FileFormatInfo,
    IntakeReport,
    MetricInfo,
    ObjectOptions,
    ObjectSource,
    Problem,
    ProtocolInfo,
    SourceInfo,
    Unit,
)
from fingersplit_service.app import create_app
from fingersplit_service.jobs.worker_functions import _catalogs
from fingersplit_service.settings import ServiceSettings

pytestmark = pytest.mark.anyio


@pytest.fixture(scope="module")
def schema(tmp_path_factory) -> dict:
    return create_app(ServiceSettings(data_dir=tmp_path_factory.mktemp("unused")), FUNCTIONS).openapi()


async def test_everything_is_described(schema):
    missing = []
    for name, component in schema["components"]["schemas"].items():
        for field, one in component.get("properties", {}).items():
            if not one.get("description"):
                missing.append(f"{name}.{field}")
    for path, methods in schema["paths"].items():
        for method, operation in methods.items():
            where = f"{method} {path}"
            missing += [where for key in ("summary", "description", "tags") if not operation.get(key)]
            missing += [
                f"{where} {one['name']}" for one in operation.get("parameters", []) if not one.get("description")
            ]
            missing += [f"{where} {status}" for status, one in operation["responses"].items() if not one["description"]]
    assert missing == []


async def test_every_refusal_is_a_problem_document(schema):
    for methods in schema["paths"].values():
        for operation in methods.values():
            refusals = [one for status, one in operation["responses"].items() if int(status) >= 400]
            assert refusals
            assert all(list(one["content"]) == ["application/problem+json"] for one in refusals)
    assert "HTTPValidationError" not in schema["components"]["schemas"]


async def test_references_lead_somewhere(schema):
    def references(node):
        if isinstance(node, dict):
            if "$ref" in node:
                yield node["$ref"]
            for one in node.values():
                yield from references(one)
        elif isinstance(node, list):
            for one in node:
                yield from references(one)

    known = {f"#/components/schemas/{name}" for name in schema["components"]["schemas"]}
    assert set(references(schema)) <= known


async def test_planner_settings_are_listed(schema):
    text = schema["components"]["schemas"]["JobCreate"]["properties"]["planner"]["description"]
    assert all(f"`{setting.name}`" in text for setting in fields(PlannerSettings))


@pytest.mark.parametrize("kind", [CoreIntakeReport, CoreCloudReport, CoreOptions, CoreSource], ids=lambda k: k.__name__)
def test_schemas_of_objects_have_the_planners_fields(kind):
    """Names, order, defaults and whether null is allowed; reports of older files may lack what has a default here."""
    schema = {CoreIntakeReport: IntakeReport, CoreCloudReport: CloudReport, CoreSource: ObjectSource}.get(kind)
    documented = (schema or ObjectOptions).model_fields
    known = {part.name: part for part in fields(kind)}
    assert list(documented) == [*known, *getattr(kind, "computed", ())]
    hints = get_type_hints(kind)
    for name, part in known.items():
        if part.default is not MISSING:
            assert documented[name].default == part.default
        if NoneType in get_args(hints[name]):
            assert NoneType in get_args(documented[name].annotation)
        if "doc" in part.metadata:
            unit = part.metadata["unit"]
            said = part.metadata["doc"].removesuffix(".") + (f" [{unit}]" if unit != "1" else "") + "."
            assert documented[name].description == said


def test_choices_of_objects_are_the_planners():
    assert set(get_args(Unit)) == set(UNITS)
    method = IntakeReport.model_fields["volume_method"].annotation
    assert get_args(method) == get_args(VolumeMethod)


async def test_options_have_the_planners_ranges():
    for option in fields(CoreOptions):
        low, high = option.metadata["low"], option.metadata["high"]
        for value in (low, high):
            assert getattr(ObjectOptions(**{option.name: value}), option.name) == value
        for value in (np.nextafter(low, -np.inf), np.nextafter(high, np.inf)):
            with pytest.raises(ValidationError):
                ObjectOptions(**{option.name: value})
        assert ObjectOptions.model_fields[option.name].default == option.default


async def test_requests_have_examples(schema):
    content = schema["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]["application/json"]
    assert content["examples"]


@pytest.mark.parametrize(
    ("method", "path", "status", "kind"),
    [
        ("GET", "/nowhere", 404, "not-found"),
        ("GET", "/v1/../../etc/passwd", 404, "not-found"),
        ("DELETE", "/v1/hands", 405, "method-not-allowed"),
        ("GET", "/v1/jobs/x/grasps/one/picture.png", 422, "invalid-request"),
        ("GET", "/v1/jobs?limit=many", 422, "invalid-request"),
    ],
)
async def test_refusals(api, method, path, status, kind):
    response = await api.http.request(method, path)

    problem = Problem.model_validate_json(response.content)
    assert response.headers["Content-Type"] == "application/problem+json"
    assert response.status_code == problem.status == status
    assert problem.type == f"urn:fingersplit:problem:{kind}"
    assert problem.title
    assert problem.detail


async def test_a_fault_shows_nothing_of_the_inside(api):
    async def broken():
        raise RuntimeError("secret of the inside")

    api.app.router.routes.append(fastapi.routing.APIRoute("/broken", broken))
    response = await api.http.get("/broken")
    api.app.router.routes.pop()

    assert response.status_code == 500
    assert Problem.model_validate_json(response.content).type == "urn:fingersplit:problem:internal-error"
    assert "secret" not in response.text


async def test_health(api):
    assert (await api.http.get("/healthz")).json() == {"status": "ok"}
    assert (await api.http.get("/readyz")).json() == {"status": "ready", "workers": 1}
    page = await api.http.get("/docs")
    assert page.status_code == 200
    loaded = re.findall(r"""(?:src|href)=["']([^"']+)""", page.text)
    assert any(address.endswith(".js") for address in loaded)
    for address in loaded:  # from the service itself, also without a way to the internet
        assert httpx2.URL(address).host in ("", api.http.base_url.host), address
        assert (await api.http.get(address)).status_code == 200


async def test_before_the_workers_are_warm(tmp_path):
    app = create_app(ServiceSettings(data_dir=tmp_path, workers=1), FUNCTIONS)
    transport = httpx2.ASGITransport(app)
    async with (
        app.router.lifespan_context(app),
        httpx2.AsyncClient(transport=transport, base_url="http://localhost") as http,
    ):
        assert (await http.get("/healthz")).status_code == 200
        for path in ("/readyz", "/v1/hands"):
            response = await http.get(path)
            assert (response.status_code, response.headers["Retry-After"]) == (503, "1")
            assert Problem.model_validate_json(response.content).type == "urn:fingersplit:problem:not-ready"


async def test_what_the_planner_knows_is_listed(api):
    """The workers say what their registries hold; every document is of its schema."""
    (metric,) = (await api.http.get("/v1/metrics")).json()
    assert (metric["name"], metric["higher_is_better"]) == ("holding_margin", True)
    assert [source["name"] for source in (await api.http.get("/v1/sources")).json()] == [
        "antipodal",
        "both",
        "surface_fitting",
    ]
    assert [one["name"] for one in (await api.http.get("/v1/formats")).json()] == ["moveit"]
    assert "lift" in {one["name"] for one in (await api.http.get("/v1/protocols")).json()}
    assert "virtual_frame" in {one["name"] for one in (await api.http.get("/v1/controllers")).json()}


def test_the_planners_registries_are_of_the_listed_schemas():
    catalogs = _catalogs()
    schemas = {"metrics": MetricInfo, "formats": FileFormatInfo, "sources": SourceInfo}
    for kind, schema in (schemas | {"protocols": ProtocolInfo, "controllers": ControllerInfo}).items():
        assert catalogs[kind]
        for document in catalogs[kind]:
            assert schema.model_validate(document).model_dump() == document
    written = {one["name"] for one in catalogs["formats"] if one["writes"]}
    assert {"isaac_grasp", "moveit", "dexgraspbench"} <= written
