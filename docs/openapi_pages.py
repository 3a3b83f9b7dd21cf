"""The HTTP reference: an OpenAPI document as Markdown."""

from collections.abc import Iterable, Sequence
from typing import Any

Json = dict[str, Any]


def table(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def describe_operations(openapi: Json) -> str:
    """Every operation by tag with its parameters, body and answer; then the schemas. Errors are left out."""
    parts, schemas = [], openapi["components"]["schemas"]
    tags = [tag["name"] for tag in openapi["tags"]]
    for tag in tags:
        parts.append(f"## {tag}\n")
        for path, operations in openapi["paths"].items():
            for method, operation in operations.items():
                if tag in operation.get("tags", []):
                    parts.append(_operation(f"{method.upper()} {path}", operation))
    parts.append("## Schemas\n")
    parts += (_schema(name, schema) for name, schema in schemas.items() if "properties" in schema)
    return "\n".join(parts)


def _operation(call: str, operation: Json) -> str:
    lines = [f"### `{call}`\n", f"**{operation['summary']}** (`{operation['operationId']}`)\n"]
    lines.append(operation.get("description", "") + "\n")
    rows = [
        (f"`{one['name']}`", one["in"], _kind(one["schema"]), one.get("description", ""))
        for one in operation.get("parameters", ())
    ]
    if rows:
        lines.append(table(("parameter", "in", "type", "meaning"), rows))
    for media, body in operation.get("requestBody", {}).get("content", {}).items():
        lines.append(f"Body, `{media}`: {_kind(body.get('schema', {}))}\n")
    for code, answer in operation["responses"].items():
        if code < "400":
            kinds = ", ".join(f"`{m}` {_kind(c.get('schema', {}))}" for m, c in answer.get("content", {}).items())
            lines.append(f"{code}: {answer['description'].rstrip('.')}. {kinds}\n")
    return "\n".join(lines)


def _schema(name: str, schema: Json) -> str:
    required = schema.get("required", ())
    rows = (
        (f"`{key}`", _kind(one), "required" if key in required else f"`{one.get('default')}`", _meaning(one))
        for key, one in schema["properties"].items()
    )
    text = schema.get("description", "").partition("\n\n")[0]
    return f"### {name}\n\n{text}\n\n" + table(("field", "type", "default", "meaning"), rows)


def _meaning(schema: Json) -> str:
    return str(schema.get("description", "")).replace("\n", " ")


def _kind(schema: Json) -> str:
    """The type of a schema in a few words, with links to named ones."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if choices := schema.get("anyOf") or schema.get("oneOf"):
        return " or ".join(dict.fromkeys(_kind(choice) for choice in choices))
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    if schema.get("type") == "array":
        return f"list of {_kind(schema.get('items', {}))}"
    return str(schema.get("const", schema.get("format", schema.get("type", "any"))))
