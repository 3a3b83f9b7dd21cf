"""Extension points: a folder whose every module defines one thing of a kind, found by looking."""

import inspect
from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, TypeVar

__all__ = ["find_by_name", "find_classes_by_name", "first_line"]

_Kind = TypeVar("_Kind")


def find_by_name(package: str, kind: type[_Kind]) -> dict[str, _Kind]:
    """Everything of a kind that the modules of a package define, by its ``name``, in the order of the names.

    Args:
        package: Dotted name of the package; its ``__path__`` may have several folders.
        kind: Type of what is looked for; what a module only imports counts, too, once.

    Raises:
        ImportError: Two of them have the same name.
    """
    return _find(package, lambda value: isinstance(value, kind))


def find_classes_by_name(package: str, base: type) -> dict[str, Any]:
    """As `find_by_name`, of the subclasses of ``base``."""
    return _find(package, lambda value: isinstance(value, type) and issubclass(value, base) and value is not base)


def _find(package: str, is_wanted: Callable[[Any], bool]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for module in iter_modules(import_module(package).__path__):
        for value in filter(is_wanted, vars(import_module(f"{package}.{module.name}")).values()):
            if found.setdefault(value.name, value) is not value:
                raise ImportError(f"{package} has two entries called {value.name!r}; the second is in {module.name!r}.")
    return dict(sorted(found.items()))


def first_line(kind: type) -> str:
    """The first line of a class's docstring: what lists say of it."""
    return (inspect.getdoc(kind) or "").partition("\n")[0]
