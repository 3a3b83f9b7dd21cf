"""Documents of a scene: dataclasses that list their entries, and documents inside documents.

A document class lists its entries as dataclass fields made by ``entry``. Values are checked in the constructor, so a
scene built in Python and one read from JSON raise the same errors, and every error names the entry.
"""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, Self

from fingersplit.errors import SceneError
from fingersplit.scene.kinds import Kind, shown

__all__ = ["Document", "Record", "entry"]


@dataclass(frozen=True)
class Record(Kind):
    """A document inside a document."""

    document: "type[Document]"

    def read(self, value: Any) -> "Document":
        """The inner document."""
        return value if isinstance(value, self.document) else self.document.from_document(value)

    def write(self, value: "Document") -> dict[str, Any]:
        """The inner document as plain JSON data."""
        return value.to_document()

    def schema(self) -> dict[str, Any]:
        """An object."""
        return self.document.json_schema()


@dataclass(frozen=True)
class Document:
    """A dataclass whose fields are made by ``entry``.

    Raises:
        SceneError: A value that is not allowed; the error names the entry.
    """

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if value is None and item.default is None:
                continue
            try:
                object.__setattr__(self, item.name, item.metadata["kind"].read(value))
            except SceneError as error:
                raise error.inside(item.name) from None
        self.check()

    def check(self) -> None:
        """Look at what the entries say together.

        Raises:
            SceneError: They contradict each other.
        """

    @classmethod
    def from_document(cls, document: Any) -> Self:
        """From plain JSON data; entries that are left out keep their defaults.

        Raises:
            SceneError: An unknown or missing entry, or a value that is not allowed; the error names the entry.
        """
        if not isinstance(document, Mapping):
            raise SceneError("", f"must be an object with named entries, got {shown(document)}.")
        known = {item.name: item for item in fields(cls)}
        for name in document:
            if name not in known:
                raise SceneError(str(name), f"is not known here; known: {', '.join(known)}.")
        for name, item in known.items():
            if name not in document and item.default is MISSING:
                raise SceneError(name, f"is missing: {item.metadata['doc']}")
        return cls(**document)

    def to_document(self) -> dict[str, Any]:
        """The same as plain JSON data; entries that are not set are left out."""
        return {
            item.name: item.metadata["kind"].write(getattr(self, item.name))
            for item in fields(self)
            if getattr(self, item.name) is not None
        }

    @classmethod
    def json_schema(cls) -> dict[str, Any]:
        """JSON Schema of the document."""
        properties = {}
        for item in fields(cls):
            kind: Kind = item.metadata["kind"]
            described = kind.schema() | {"description": item.metadata["doc"]}
            if item.default is None:
                described = {"anyOf": [kind.schema(), {"type": "null"}], "description": item.metadata["doc"]}
            elif item.default is not MISSING:
                described["default"] = kind.write(kind.read(item.default))
            properties[item.name] = described
        return {
            "type": "object",
            "title": cls.__name__,
            "description": (cls.__doc__ or "").partition("\n")[0],
            "properties": properties,
            "required": [item.name for item in fields(cls) if item.default is MISSING],
            "additionalProperties": False,
        }


def entry(kind: Kind, doc: str, default: Any = MISSING) -> Any:
    """A dataclass field of a ``Document``; ``default`` None means that it may be left out."""
    return field(default=default, metadata={"kind": kind, "doc": doc})
