"""Optional parts of the package, and what is said when one of them is not installed."""

from collections.abc import Iterator
from contextlib import contextmanager

from fingersplit.errors import MissingExtraError

__all__ = ["extra"]


@contextmanager
def extra(name: str) -> Iterator[None]:
    """Import the packages of an extra inside this context.

    Args:
        name: Of the extra, as in ``pip install 'fingersplit[recording]'``.

    Raises:
        MissingExtraError: A package of the extra is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingExtraError(str(error.name), name) from error
