import inspect
import types

import pytest
from pydantic import BaseModel

import fingersplit_client
from fingersplit_client import AsyncClient, Client, schemas


@pytest.mark.parametrize("package", [fingersplit_client, schemas])
def test_all_names_what_is_public(package: types.ModuleType) -> None:
    public = {
        name
        for name, value in vars(package).items()
        if not name.startswith("_") and not isinstance(value, types.ModuleType)
    }
    assert set(package.__all__) == public
    assert len(package.__all__) == len(public)


def test_both_clients_have_the_same_methods() -> None:
    for name, method in inspect.getmembers(Client, inspect.isfunction):
        if name.startswith("_"):
            continue
        twin = getattr(AsyncClient, name)
        if inspect.isgeneratorfunction(method):
            assert inspect.isasyncgenfunction(twin)
            assert inspect.signature(twin).parameters == inspect.signature(method).parameters
        else:
            assert inspect.iscoroutinefunction(twin)
            assert inspect.signature(twin) == inspect.signature(method)
        assert (inspect.getdoc(twin) or "").split("\n")[1:] == (inspect.getdoc(method) or "").split("\n")[1:]


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
