"""Results in files."""

import json
from pathlib import Path

from fingersplit.errors import ResultError
from fingersplit.result.plan import PlanResult

__all__ = ["read_result", "write_result"]


def read_result(path: Path | str) -> PlanResult:
    """A result from a JSON file, as ``fingersplit plan --json`` and the service write it.

    Raises:
        ResultError: The file cannot be read, is not JSON or holds no result of this version.
    """
    path = Path(path)
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise ResultError(f"{path} cannot be read: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        where = f" beyond line {error.lineno}" if isinstance(error, json.JSONDecodeError) else " in UTF-8"
        raise ResultError(f"{path} is not JSON{where}.") from error
    try:
        return PlanResult.from_dict(document)
    except ResultError as error:
        raise ResultError(f"{path}: {error}") from error


def write_result(result: PlanResult, path: Path) -> None:
    """Write a result as JSON."""
    path.write_text(json.dumps(result.to_dict(), indent=2, allow_nan=False) + "\n")
