"""Tables of the reference pages, taken from the registries and settings so that they cannot differ from the program."""

import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import click
import typer
from openapi_pages import describe_operations, table
from typer.cli import get_docs_for_click

from fingersplit.cli.main import add_commands, app
from fingersplit.contacts.metrics import available_metrics
from fingersplit.formats import available_formats
from fingersplit.formats.file_format import FileFormat
from fingersplit.parallel_grasps.sources import available_sources
from fingersplit.scene import Constraints
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.termination import Termination
from fingersplit.verification.protocols import available_protocols
from fingersplit_service.app import create_app
from fingersplit_service.settings import ServiceSettings


def write_tables(folder: Path) -> None:
    """Write every table as a Markdown file into a folder."""
    for name, text in {
        "metrics": _metrics(),
        "formats": _formats(),
        "sources": table(("source", "meaning"), ((s.name, s.meaning) for s in available_sources().values())),
        "protocols": _protocols(),
        "planner_settings": _planner_settings(),
        "service_settings": _service_settings(),
        "command_line": _command_line(),
        "constraints": "\n".join(_constraints(Constraints.json_schema()).values()),
        "http": describe_operations(create_app(ServiceSettings()).openapi()),
        "terminations": table(("end", "what it means and what may help"), ((t.label, t.advice) for t in Termination)),
    }.items():
        (folder / f"{name}.md").write_text(text)


def _metrics() -> str:
    rows = (
        (f"`{one.name}`", one.unit, "higher" if one.higher_is_better else "lower", one.meaning, one.source)
        for one in available_metrics().values()
    )
    return table(("metric", "unit", "better", "meaning", "source"), rows)


def _formats() -> str:
    def uses(one: FileFormat) -> str:
        said = {
            "parallel grasps read": one.read_parallel,
            "grasps of hands read": one.read_hand,
            "results written": one.write,
        }
        return ", ".join(text for text, function in said.items() if function is not None)

    rows = ((f"`{one.name}`", one.suffix, one.title, uses(one)) for one in available_formats().values())
    return table(("format", "file", "what it is", "use"), rows)


def _protocols() -> str:
    parts = []
    for name, protocol in available_protocols().items():
        numbers = [one for one in fields(protocol) if "doc" in one.metadata]
        rows = ((f"`{n.name}`", getattr(protocol, n.name), n.metadata["unit"], n.metadata["doc"]) for n in numbers)
        summary = (type(protocol).__doc__ or "").partition("\n\n")[0]
        parts.append(f"### `{name}`\n\n{summary}\n\n" + table(("number", "value", "unit", "meaning"), rows))
    return "\n".join(parts)


def _planner_settings() -> str:
    rows = (
        (f"`{one.name}`", one.default, one.metadata["paper"], one.metadata["unit"], one.metadata["doc"])
        for one in fields(PlannerSettings)[1:]
    )
    return table(("setting", "default", "paper", "unit", "meaning"), rows)


def _service_settings() -> str:
    rows = (
        (f"`FINGERSPLIT_{name.upper()}`", "" if one.default_factory else one.default, one.description or "")
        for name, one in ServiceSettings.model_fields.items()
    )
    return table(("variable", "default", "meaning"), rows)


def _command_line() -> str:
    add_commands()
    command = typer.main.get_command(app)
    context = click.Context(command, info_name="fingersplit")
    text = get_docs_for_click(obj=command, ctx=context, name="fingersplit")
    return re.sub("^#", "##", text, flags=re.MULTILINE)


def _constraints(schema: dict[str, Any]) -> dict[str, str]:
    """A table for every record of the scene's JSON Schema, by title."""
    rows, inner = [], dict[str, str]()
    for name, one in schema["properties"].items():
        record = next((found for found in _records(one)), None)
        kind = f"[{record['title']}](#{record['title'].lower()})" if record else _kind(one)
        default = "" if record else one.get("default", "")
        rows.append((f"`{name}`", kind, default, one.get("description", "")))
        if record:
            inner |= _constraints(record)
    heads = ("entry", "type", "default", "meaning")
    return {schema["title"]: f"### {schema['title']}\n\n{schema['description']}\n\n{table(heads, rows)}"} | inner


def _records(schema: dict[str, Any]) -> list[dict[str, Any]]:
    """The records that an entry holds, itself or in a list."""
    choices = [schema, schema.get("items", {}), *schema.get("anyOf", ())]
    choices += [choice.get("items", {}) for choice in schema.get("anyOf", ())]
    return [choice for choice in choices if "properties" in choice]


def _kind(schema: dict[str, Any]) -> str:
    choices = [one for one in schema.get("anyOf", [schema]) if one.get("type") != "null"]
    return " or ".join(str(one.get("type", one.get("enum", "any"))) for one in choices)
