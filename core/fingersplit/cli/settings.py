"""The commands that tell what can be said: settings with their ranges, and scenes."""

import json
from collections.abc import Iterator
from dataclasses import Field, fields
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from fingersplit.cli.output import new_table
from fingersplit.errors import SettingsError, suggestion

__all__ = ["scene", "settings"]


def settings(
    topic: Annotated[
        str | None, typer.Argument(help="planner, object, or a protocol or controller; default: the planner's.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print all of them as JSON.")] = False,
) -> None:
    """List settings with their defaults, units, ranges and meanings.

    Those of the planner are for `plan --setting NAME=VALUE`, those of a protocol for `verify --number NAME=VALUE`, and
    those of objects are options of `plan`. `fingersplit serve --show-settings` lists those of the service.
    """
    topics = _topics()
    if as_json:
        documents = {name: [_document(one, value) for one, value in rows] for name, (_, rows) in topics.items()}
        typer.echo(json.dumps(documents, indent=2))
        return
    chosen = topic or "planner"
    if chosen not in topics:
        raise SettingsError(f"There are no settings of {chosen!r}; {suggestion(chosen, topics)}")
    title, rows = topics[chosen]
    columns = {"setting": "left", "default": "right", "unit": "left", "range": "left", "meaning": "left"}
    if chosen == "planner":
        columns = {"setting": "left", "default": "right", "paper": "right"} | columns
    table = new_table(title, columns, None if topic else f"Other topics: {', '.join(sorted(topics))}.")
    for one, value in rows:
        said = _document(one, value)
        bounds = "" if said["low"] is None else f"{said['low']:g} to {said['high']:g}"
        paper = [_shown(one.metadata.get("paper"))] if chosen == "planner" else []
        table.add_row(one.name, _shown(value), *paper, said["unit"], bounds, said["meaning"])
    Console(width=None if Console().is_terminal else 160, highlight=False, markup=False).print(table)


def scene(
    file: Annotated[
        Path | None, typer.Argument(help="JSON file as `plan --scene` takes it.", exists=True, dir_okay=False)
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of such files.")] = False,
) -> None:
    """Check a scene and print it whole, with every default; or print what a scene can say."""
    from fingersplit.cli.scenes import read_constraints
    from fingersplit.scene import Constraints

    if file is None and not schema:
        raise SettingsError("Give a scene's file, or --schema.")
    document = Constraints.json_schema() if file is None else read_constraints(file, False, ()).to_document()
    typer.echo(json.dumps(document, indent=2))


Rows = list[tuple["Field[Any]", Any]]


def _topics() -> dict[str, tuple[str, Rows]]:
    """Title and settings with their values, by what they belong to."""
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.splitting.settings import PlannerSettings
    from fingersplit.verification.controllers import available_controllers
    from fingersplit.verification.protocols import available_protocols

    found = {
        "planner": ("Planner settings", list(_rows(PlannerSettings()))),
        "object": ("Object options", list(_rows(ObjectOptions()))),
    }
    for name, protocol in available_protocols().items():
        found[name] = (f"Numbers of the protocol {name}", list(_rows(protocol)))
    for name, controller in available_controllers().items():
        found[name] = (f"Numbers of the controller {name}", list(_rows(controller)))
    return found


def _rows(settings: Any) -> Iterator[tuple["Field[Any]", Any]]:
    return ((one, getattr(settings, one.name)) for one in fields(settings) if "doc" in one.metadata)


def _document(one: "Field[Any]", value: Any) -> dict[str, Any]:
    said = one.metadata
    return {
        "name": one.name,
        "default": value,
        "unit": "" if said["unit"] == "1" else said["unit"],
        "low": said.get("low"),
        "high": said.get("high"),
        "meaning": said["doc"],
    }


def _shown(value: Any) -> str:
    if value is None:
        return "none"
    return f"{value:.6g}" if type(value) is float else str(value).lower() if type(value) is bool else str(value)
