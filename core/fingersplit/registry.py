"""Extension points: a folder whose every module defines one thing of a kind, found by looking."""

import inspect
from importlib import import_module
from pkgutil import iter_modules
from typing import TypeVar

__all__ = ["find_by_name", "first_line"]

_Kind = TypeVar("_Kind")


def find_by_name(package: str, kind: type[_Kind]) -> dict[str, _Kind]:
    """Everything of a kind that the modules of a package define, by its ``name``, in the order of the names.

    Args:
        package: Dotted name of the package; its ``__path__`` may have several folders.
        kind: Type of what is looked for; what a module only imports counts, too, once.

    Raises:
        ImportError: Two of them have the same name.
    """
    found: dict[str, _Kind] = {}
    for module in iter_modules(import_module(package).__path__):
        for value in vars(import_module(f"{package}.{module.name}")).values():
            if isinstance(value, kind):
                name: str = value.name  # type: ignore[attr-defined]
                if found.setdefault(name, value) is not value:
                    raise ImportError(f"{package} has two entries called {name!r}; the second is in {module.name!r}.")
    return dict(sorted(found.items()))


def first_line(kind: type) -> str:
    """The first line of a class's docstring: what lists say of it."""
    return (inspect.getdoc(kind) or "").partition("\n")[0]
