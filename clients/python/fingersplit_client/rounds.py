"""What data sets need of a service: one call that plans a round; `fingersplit dataset --server` finds it by name."""

import os
from typing import Any

from fingersplit_client.client import Client
from fingersplit_client.errors import AuthenticationError, InvalidRequestError, JobFailed
from fingersplit_client.options import job_request

__all__ = ["Rounds", "connect"]

TIMEOUT = 24 * 3600.0
"""For one round, its place in the queue included [s]."""


class Rounds:
    """Plans for files as `Client.plan` does; threads may share it.

    Args:
        client: The service.
    """

    def __init__(self, client: Client) -> None:
        self._client = client

    def __call__(self, path: "os.PathLike[str] | str", options: dict[str, Any]) -> dict[str, Any]:
        """The result document for a file and everything that object and job are told.

        Returns:
            The document, or ``{"error": text, "code": name}`` where this object is refused; what concerns all objects
            (no service, no permission, an option that is not valid) is raised.
        """
        given = {name: value for name, value in options.items() if value is not None}
        job_request("", given)  # what no object can be planned with is raised
        try:
            return self._client.plan(path, timeout=TIMEOUT, **given).model_dump(mode="json")
        except AuthenticationError:
            raise
        except InvalidRequestError as error:
            return {"error": str(error), "code": "refused"}
        except JobFailed as error:
            return {"error": str(error), "code": error.job.error.code if error.job.error else "failed"}

    def close(self) -> None:
        """Close its connections."""
        self._client.close()


def connect(server: str | None = None, api_key: str | None = None) -> Rounds:
    """Rounds of a service, by default the one of ``FINGERSPLIT_SERVER``."""
    return Rounds(Client(server, api_key=api_key))
