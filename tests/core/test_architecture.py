"""The house, floor by floor: who may import whom, and that `__all__` says what is public."""

import ast
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
PACKAGES = {
    "fingersplit": REPOSITORY / "core" / "fingersplit",
    "fingersplit_client": REPOSITORY / "clients" / "python" / "fingersplit_client",
    "fingersplit_service": REPOSITORY / "service" / "fingersplit_service",
    "fingersplit_bench": REPOSITORY / "benchmarks" / "fingersplit_bench",
}

CONTRIBUTING = (REPOSITORY / "CONTRIBUTING.md").read_text()


def floors() -> tuple[set[str], ...]:
    """Rooms from the ground up, as the table of CONTRIBUTING.md states them: a row is a floor."""
    table = CONTRIBUTING.partition("| rooms of `core/fingersplit`")[2].partition("\n\n")[0].splitlines()[2:]
    return tuple(set(re.findall(r"`(\w+)`", row.split("|")[1])) for row in reversed(table))


FLOORS = floors()
FLOOR_OF_ROOM = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
MAY_NOT_MEET = {
    "fingersplit": {"fingersplit_service", "fingersplit_client", "fingersplit_bench"},
    "fingersplit_client": {"fingersplit", "fingersplit_service", "fingersplit_bench"},
    "fingersplit_service": {"fingersplit_bench"},
}


def sources(package: str) -> list[Path]:
    return sorted(PACKAGES[package].rglob("*.py"))


def name_of(package: str, source: Path) -> str:
    parts = source.relative_to(PACKAGES[package]).with_suffix("").parts
    return ".".join((package, *parts)).removesuffix(".__init__")


MODULES = [(package, source) for package in PACKAGES for source in sources(package)]
MODULE_IDS = [name_of(package, source) for package, source in MODULES]


def imports(source: Path) -> Iterator[str]:
    """Dotted names of everything a file imports, wherever in it."""
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{source} imports relatively"
            assert node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def room(module: str) -> str | None:
    """The room of a dotted name below fingersplit; None for the package itself."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else None


def test_the_table_of_rooms_is_the_tree():
    found = {path.stem for path in PACKAGES["fingersplit"].iterdir() if path.suffix == ".py" or path.is_dir()}
    assert found - {"__init__", "__pycache__", "py"} == set(FLOOR_OF_ROOM)


@pytest.mark.parametrize("source", sources("fingersplit"), ids=lambda source: name_of("fingersplit", source))
def test_imports_go_down(source):
    own = room(name_of("fingersplit", source))
    imported = {room(name) for name in imports(source) if name.split(".")[0] == "fingersplit"}
    if own is None:
        assert imported <= set(FLOOR_OF_ROOM)
        return
    assert own in FLOOR_OF_ROOM, f"{own} has no floor"
    for other in imported - {own}:
        assert other in FLOOR_OF_ROOM, f"{own} imports {other}, which has no floor"
        assert FLOOR_OF_ROOM[other] < FLOOR_OF_ROOM[own], f"{own} imports {other}, which is not below it"


@pytest.mark.parametrize("package", MAY_NOT_MEET)
def test_distributions_that_may_not_meet_do_not(package):
    found = sources(package)
    assert found
    for source in found:
        roots = {name.split(".")[0] for name in imports(source)}
        assert not roots & MAY_NOT_MEET[package], source


def is_registered(definition: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> bool:
    """Whether an object's decorator method takes the definition over, such as ``@app.command()``."""
    calls = (decorator.func for decorator in definition.decorator_list if isinstance(decorator, ast.Call))
    return any(isinstance(call, ast.Attribute) for call in calls)


LEFT_OUT = ("pydrake",)
"""Packages that the test tools leave out for their size."""


def public_definitions(source: Path) -> set[str]:
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    body = ast.parse(source.read_text()).body
    return {d.name for d in body if isinstance(d, kinds) and not d.name.startswith("_") and not is_registered(d)}


@pytest.mark.parametrize(("package", "source"), MODULES, ids=MODULE_IDS)
def test_all_names_what_is_public(package, source):
    try:
        module = importlib.import_module(name_of(package, source))
    except ModuleNotFoundError as error:
        if error.name not in LEFT_OUT:
            raise
        pytest.skip(f"needs {error.name}")
    declared = getattr(module, "__all__", [])
    assert public_definitions(source) <= set(declared)
    assert len(declared) == len(set(declared))
    assert [name for name in declared if not hasattr(module, name)] == []


@pytest.mark.parametrize(("package", "source"), MODULES, ids=MODULE_IDS)
def test_every_module_says_what_it_is(package, source):
    assert ast.get_docstring(ast.parse(source.read_text()))
