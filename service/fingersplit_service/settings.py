"""Settings of the service, from ``FINGERSPLIT_...`` environment variables or from the command line."""

import ipaddress
import os
from pathlib import Path

from pydantic import Field, PositiveFloat, PositiveInt, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

__all__ = ["ServiceSettings"]

_MIB = 2**20


def _default_data_dir() -> Path:
    base = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(base) / "fingersplit"


def _default_workers() -> int:
    return min(2, os.cpu_count() or 1)


class ServiceSettings(BaseSettings):
    """Everything about a service that can be chosen.

    Raises:
        pydantic.ValidationError: A value out of range, or a host that is not loopback without
            ``allow_unauthenticated``.
    """

    model_config = SettingsConfigDict(env_prefix="FINGERSPLIT_", frozen=True)

    host: str = Field(default="127.0.0.1", description="Address to listen on.")
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen on.")
    allow_unauthenticated: bool = Field(
        default=False,
        description="Listen on an address that is not loopback although anyone there can use it.",
    )
    workers: PositiveInt = Field(default_factory=_default_workers, description="Number of worker processes.")
    data_dir: Path = Field(default_factory=_default_data_dir, description="Where all data are kept.")
    max_upload_bytes: PositiveInt = Field(default=64 * _MIB, description="Largest mesh file [bytes].")
    max_request_bytes: PositiveInt = Field(default=_MIB, description="Largest body of other requests [bytes].")
    worker_memory_bytes: PositiveInt = Field(
        default=4096 * _MIB, description="Address space of one worker process [bytes]."
    )
    plan_deadline_s: PositiveFloat = Field(default=300.0, description="Longest time for planning one job [s].")
    inspection_deadline_s: PositiveFloat = Field(default=60.0, description="Longest time for one upload's mesh [s].")
    picture_deadline_s: PositiveFloat = Field(default=60.0, description="Longest time for drawing one picture [s].")
    warm_deadline_s: PositiveFloat = Field(
        default=600.0, description="Longest time for a worker to start; the first compiles the kernels [s]."
    )

    @model_validator(mode="after")
    def _refuse_strangers(self) -> "ServiceSettings":
        if not self.allow_unauthenticated and not _is_loopback(self.host):
            raise ValueError(
                f"Refusing to listen on {self.host}: without API keys anyone who reaches it could use the "
                "service. Listen on 127.0.0.1, or set FINGERSPLIT_ALLOW_UNAUTHENTICATED=true where the "
                "network itself keeps strangers out."
            )
        return self


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
