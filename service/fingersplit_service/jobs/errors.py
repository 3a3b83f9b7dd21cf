"""Why the services behind the endpoints refuse; `problems` says how each looks over HTTP."""

from collections.abc import Sequence

__all__ = [
    "InvalidField",
    "InvalidFile",
    "NotFinished",
    "NotFound",
    "ObjectInUse",
    "ResourceGone",
    "WorkersNotReady",
]


class NotFound(Exception):  # noqa: N818
    """The owner has no such job, object or set."""


class NotFinished(Exception):  # noqa: N818
    """The job has not ended, so it has no result yet."""


class ResourceGone(Exception):  # noqa: N818
    """What is needed was deleted, or cannot be reproduced any more."""


class ObjectInUse(Exception):  # noqa: N818
    """Jobs that have not ended need the object."""


class WorkersNotReady(Exception):  # noqa: N818
    """No worker is warm yet."""


class InvalidField(Exception):  # noqa: N818
    """A field of the request holds what cannot be.

    Args:
        field: JSON pointer to the field.
        detail: What is wrong and what would be right.
        code: Stable short name of the fault, where there is one.
        valid: The valid values, where they are few.
    """

    def __init__(self, field: str, detail: str, *, code: str | None = None, valid: Sequence[str] | None = None) -> None:
        super().__init__(detail)
        self.field, self.detail, self.code, self.valid = field, detail, code, valid


class InvalidFile(Exception):  # noqa: N818
    """An uploaded file holds no graspable object, or no parallel grasps.

    Args:
        detail: What is wrong and what would be right.
        code: Stable short name of the fault, where there is one.
        mesh: Whether it was to hold an object.
    """

    def __init__(self, detail: str, *, code: str | None = None, mesh: bool = False) -> None:
        super().__init__(detail)
        self.detail, self.code, self.mesh = detail, code, mesh
