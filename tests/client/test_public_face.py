import ast
import inspect
import subprocess
import sys
import types
from importlib.metadata import requires

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from pydantic import BaseModel

import fingersplit_client
from fingersplit_client import AsyncClient, Client, grasps, results, schemas
from fingersplit_client.modes import operation, stream
from fingersplit_client.options import JobKeywords, ObjectKeywords, PlanKeywords
from fingersplit_client.schemas import JobCreate, ObjectLookup

RESOURCES = ("objects", "parallel_grasps", "hands", "jobs", "batches", "datasets", "outcomes")


def test_all_names_what_is_public() -> None:
    public = {
        name
        for name, value in vars(schemas).items()
        if not name.startswith("_") and not isinstance(value, types.ModuleType)
    }
    assert set(schemas.__all__) == public
    assert len(schemas.__all__) == len(public)


def test_the_package_has_every_name_when_it_is_asked_for() -> None:
    assert dir(fingersplit_client) == sorted(fingersplit_client.__all__)
    assert len(set(fingersplit_client.__all__)) == len(fingersplit_client.__all__)
    assert all(getattr(fingersplit_client, name) is not None for name in fingersplit_client.__all__)
    assert fingersplit_client.Grasp is grasps.Grasp
    assert fingersplit_client.PlanResult is results.PlanResult
    assert fingersplit_client.Job is results.Job
    with pytest.raises(AttributeError, match="no attribute 'Clinet'"):
        _ = fingersplit_client.Clinet


def test_keywords_are_all_that_the_wire_takes() -> None:
    """An option that is added to a job or an object and not to the one-call plan fails here."""
    assert set(JobKeywords.__annotations__) == JobCreate.model_fields.keys() - {"object_id"}
    assert set(ObjectKeywords.__annotations__) == ObjectLookup.model_fields.keys() - {"sha256"} | {"name", "file_type"}
    assert PlanKeywords.__annotations__.keys() == JobKeywords.__annotations__.keys() | ObjectKeywords.__annotations__
    wire = {name: field.annotation for name, field in (JobCreate.model_fields | ObjectLookup.model_fields).items()}
    for name, annotation in PlanKeywords.__annotations__.items():
        if name in ("name", "file_type"):
            continue
        assert _plain(annotation) == _plain(wire[name]), name


def _plain(annotation: object) -> str:
    """A type without the limits of its values."""
    return (
        str(annotation).replace("NoneType", "None").split("Annotated[")[-1].split(", FieldInfo")[0].split(" | None")[0]
    )


def test_every_option_of_a_plan_is_documented() -> None:
    described = inspect.getdoc(Client.plan) or ""
    assert [name for name in PlanKeywords.__annotations__ if f"``{name}``" not in described] == []


def test_both_clients_have_the_same_operations() -> None:
    """They are the same descriptors, so there is nothing to differ in; what they return is awaited or not."""
    blocking, awaited = Client(), AsyncClient()
    for name in ("plan", "ready"):
        assert inspect.getattr_static(Client, name) is inspect.getattr_static(AsyncClient, name)
    for resource in RESOURCES:
        assert type(getattr(blocking, resource)) is type(getattr(awaited, resource))
    blocking.close()


def test_operations_can_be_looked_at() -> None:
    with Client() as client:
        for resource in (client, *(getattr(client, name) for name in RESOURCES)):
            for name, member in inspect.getmembers_static(type(resource)):
                if isinstance(member, operation | stream):
                    method = getattr(resource, name)
                    assert (method.__name__, method.__doc__) == (name, member.__doc__)
                    assert member.__doc__
                    assert "self" not in inspect.signature(method).parameters


def test_every_field_is_described() -> None:
    models = [value for value in vars(schemas).values() if inspect.isclass(value) and issubclass(value, BaseModel)]
    undescribed = [
        f"{model.__name__}.{name}"
        for model in models
        for name, field in model.model_fields.items()
        if not field.description
    ]
    assert len(models) > 20
    assert undescribed == []


def test_the_client_alone_needs_few_packages() -> None:
    needed, waiting = set(), ["fingersplit-client"]
    while waiting:
        name = waiting.pop()
        needed.add(name)
        wanted = [Requirement(text) for text in requires(name) or []]
        names = [
            canonicalize_name(one.name) for one in wanted if one.marker is None or one.marker.evaluate({"extra": ""})
        ]
        waiting += [name for name in names if name not in needed]
    assert len(needed) <= 12, sorted(needed)
    assert "numpy" not in needed


def test_importing_it_loads_nothing_numeric() -> None:
    code = "import sys; from fingersplit_client import AsyncClient, Client; print(sorted(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert not {"numpy", "fingersplit", "rich", "typer"} & set(ast.literal_eval(loaded.stdout))
