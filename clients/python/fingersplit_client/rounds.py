"""What data sets need of a service: one call that plans a round; `fingersplit dataset --server` finds it by name."""

import os
from collections.abc import Callable
from typing import Any

from fingersplit_client.client import Client
from fingersplit_client.errors import AuthenticationError, InvalidRequestError, JobFailed
from fingersplit_client.options import job_request

__all__ = ["connect"]

TIMEOUT = 24 * 3600.0
"""For one round, its place in the queue included [s]."""


def connect(
    server: str | None = None, api_key: str | None = None
) -> "Callable[[os.PathLike[str] | str, dict[str, Any]], dict[str, Any]]":
    """A function that plans for a file as `Client.plan` does; threads may share it.

    Returns:
        From file and options to the result document, or to ``{"error": text, "code": name}`` where this object is
        refused; what concerns all objects (no service, no permission) is raised.
    """
    client = Client(server, api_key=api_key)

    def plan(path: "os.PathLike[str] | str", options: dict[str, Any]) -> dict[str, Any]:
        given = {name: value for name, value in options.items() if value is not None}
        job_request("", given)  # what no object can be planned with is raised
        try:
            return client.plan(path, timeout=TIMEOUT, **given).model_dump(mode="json")
        except AuthenticationError:
            raise
        except InvalidRequestError as error:
            return {"error": str(error), "code": "refused"}
        except JobFailed as error:
            return {"error": str(error), "code": error.job.error.code if error.job.error else "failed"}

    return plan
