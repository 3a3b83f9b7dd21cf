"""The error tree: bad input raises one of these; a grasp that cannot be found is a result, not an exception."""

import difflib
from collections.abc import Iterable

__all__ = [
    "CacheError",
    "DatasetError",
    "FingersplitError",
    "FormatError",
    "HandError",
    "MissingExtraError",
    "ObjectFileError",
    "OutputError",
    "ParallelGraspError",
    "ResultError",
    "SceneError",
    "SettingsError",
    "UnknownHandError",
    "ViewerError",
    "suggestion",
]


def suggestion(name: str, known: Iterable[str], what: str = "") -> str:
    """What ends a sentence about an unknown name: the known one that is spelt most like it, and all of them.

    Args:
        name: The unknown name.
        known: The known ones.
        what: What they are, such as ``hands``.
    """
    names = list(known)
    near = difflib.get_close_matches(name, names, 1)
    return f"{f'did you mean {near[0]!r}? K' if near else 'k'}nown{what and f' {what}'}: {', '.join(names)}."


class FingersplitError(Exception):
    """Root of every error raised on purpose; its text says what is wrong and what would be right."""


class CacheError(FingersplitError):
    """A cache folder, a limit, a key or an array that cannot be used."""


class DatasetError(FingersplitError):
    """A folder that is no data set, belongs to another one, or cannot be written."""


class ObjectFileError(FingersplitError):
    """A file that is no graspable object.

    Attributes:
        code: Stable short name of the fault, such as ``"truncated"``.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code

    def __reduce__(self) -> tuple[type["ObjectFileError"], tuple[str, str]]:
        """Survive the way back from a worker process with both arguments."""
        return type(self), (self.code, str(self))


class MissingExtraError(FingersplitError, ImportError):
    """An optional part of the package is needed and not installed."""

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(f"This needs the package {package!r}: pip install 'fingersplit[{extra}]'.")
        self.package, self.extra = package, extra

    def __reduce__(self) -> tuple[type["MissingExtraError"], tuple[str, str]]:
        """Survive the way back from a worker process with both arguments."""
        return type(self), (self.package, self.extra)


class UnknownHandError(FingersplitError):
    """A hand name that no folder of ``fingersplit.hands`` has."""

    def __init__(self, name: str, known: Iterable[str]) -> None:
        self.name, self.known = name, tuple(known)
        super().__init__(f"Unknown hand {name!r}; {suggestion(name, self.known, 'hands')}")

    def __reduce__(self) -> tuple[type["UnknownHandError"], tuple[str, tuple[str, ...]]]:
        """Survive the way back from a worker process with both arguments."""
        return type(self), (self.name, self.known)


class HandError(FingersplitError):
    """A hand whose description or model cannot be planned with; the text says what to change."""


class ParallelGraspError(FingersplitError):
    """Two contacts and an approach that describe no parallel grasp.

    Attributes:
        index: Place of the grasp among those that were given, from 0; None where it is not known.
    """

    def __init__(self, message: str, index: int | None = None) -> None:
        super().__init__(message)
        self.index = index


class SettingsError(FingersplitError):
    """An unknown planner setting, or a value outside its range."""


class FormatError(FingersplitError):
    """A file of another tool that is not of its format, or a result that cannot be written in one."""


class OutputError(FingersplitError):
    """A file that cannot be written."""


class ResultError(FingersplitError):
    """A stored result that is none, belongs to another object, hand or version, or could not be reproduced."""


class SceneError(FingersplitError):
    """A scene, approach or other constraint that cannot be used.

    Attributes:
        field: The entry that is wrong, such as ``scene.obstacles[2].primitive.dimensions``.
        problem: What is wrong with it, and what would be right.
    """

    def __init__(self, field: str, problem: str) -> None:
        super().__init__(f"{field or 'The document'}{' ' if problem[:1].islower() else ': '}{problem}")
        self.field, self.problem = field, problem

    def __reduce__(self) -> tuple[type["SceneError"], tuple[str, str]]:
        """Survive the way back from a worker process with both arguments."""
        return type(self), (self.field, self.problem)

    def inside(self, outer: str) -> "SceneError":
        """The same error as seen from the document around, where the entry or list item is ``outer``."""
        joint = "." if self.field and not self.field.startswith("[") else ""
        return SceneError(f"{outer}{joint}{self.field}", self.problem)


class ViewerError(FingersplitError):
    """The viewer of recordings cannot be set up or started."""
