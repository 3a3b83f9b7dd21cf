"""Settings of the service: from the command line, ``FINGERSPLIT_...`` environment variables, or a TOML file."""

import ipaddress
import os
from pathlib import Path
from typing import Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict, TomlConfigSettingsSource

__all__ = ["ServiceSettings", "is_address", "is_loopback", "settings_table"]

_MIB = 2**20
_DAY = 86_400.0


def _default_data_dir() -> Path:
    base = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(base) / "fingersplit"


def _default_workers() -> int:
    return min(2, os.cpu_count() or 1)


class ServiceSettings(BaseSettings):
    """Everything about a service that can be chosen.

    An option wins over the environment, the environment over the file that ``FINGERSPLIT_CONFIG`` names.

    Raises:
        pydantic.ValidationError: A value out of range.
    """

    model_config = SettingsConfigDict(env_prefix="FINGERSPLIT_", frozen=True, extra="forbid")

    host: str = Field(default="127.0.0.1", description="Address to listen on; beyond loopback only with API keys.")
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen on.")
    allowed_hosts: tuple[str, ...] = Field(
        default=(), description="Names by which clients may address a service without keys, besides loopback."
    )
    allow_unauthenticated: bool = Field(
        default=False, description="Listen beyond loopback without API keys, although anyone there can use it."
    )
    workers: PositiveInt = Field(default_factory=_default_workers, description="Worker processes that work at once.")
    spare_workers: int = Field(
        default=1, ge=0, description="Warm worker processes kept to take over at once when another dies."
    )
    data_dir: Path = Field(default_factory=_default_data_dir, description="Where all data are kept.")
    database_url: str | None = Field(
        default=None, description="PostgreSQL database to keep the tables in; by default a file in data_dir."
    )
    database_session_url: str | None = Field(
        default=None,
        description="The same database past a pooler that shares sessions, for LISTEN; without, waits may take 0.5 s.",
    )
    storage_url: str | None = Field(
        default=None,
        description="Object store that machines share: s3://, gs://, az:// or file://; by default all is in data_dir.",
    )
    database_wait_s: NonNegativeFloat = Field(
        default=30.0, description="How long a start waits for a PostgreSQL that does not answer yet [s]."
    )
    agent_silence_s: PositiveFloat = Field(
        default=3.0, description="After this time without a sign of life another machine takes its jobs [s]."
    )
    cache_bytes: PositiveInt = Field(
        default=2048 * _MIB,
        description="Most that prepared objects may take below data_dir; the least recently used go first [bytes].",
    )
    max_upload_bytes: PositiveInt = Field(
        default=64 * _MIB, description="Largest file of an object or of grasps [bytes]."
    )
    max_request_bytes: PositiveInt = Field(default=_MIB, description="Largest body of other requests [bytes].")
    max_queued_jobs: PositiveInt = Field(default=10_000, description="Most jobs of one owner that may wait.")
    max_jobs_per_minute: PositiveInt | None = Field(
        default=None, description="Most jobs of one owner accepted in a minute; by default any number."
    )
    max_stored_bytes: PositiveInt | None = Field(
        default=None,
        description="Most that objects, hands and results of one owner may take; by default any amount [bytes].",
    )
    max_cpu_s_per_day: PositiveFloat | None = Field(
        default=None, description="CPU time of workers that one owner may use in a day, UTC; by default any [s]."
    )
    max_connections: PositiveInt = Field(
        default=1_000, description="Most connections, and most requests under way, at once; probes are not counted."
    )
    max_waiting: PositiveInt = Field(
        default=200, description="Most requests and event streams of one owner that may wait for jobs at once."
    )
    cors_origins: tuple[str, ...] = Field(
        default=(), description="Origins such as https://cell.example whose pages may use the service with a key."
    )
    header_timeout_s: PositiveFloat = Field(default=10.0, description="Longest time for a request's headers [s].")
    body_timeout_s: PositiveFloat = Field(default=60.0, description="Longest time for a request's body [s].")
    write_timeout_s: PositiveFloat = Field(
        default=30.0, description="Longest time that a client may leave an answer unread [s]."
    )
    keepalive_s: PositiveFloat = Field(
        default=15.0, description="After this time without news an event stream says that it is still there [s]."
    )
    max_wait_s: PositiveFloat = Field(default=300.0, description="Longest time that `Prefer: wait` may ask for [s].")
    worker_memory_bytes: PositiveInt = Field(
        default=4096 * _MIB, description="Address space of one worker process [bytes]."
    )
    worker_recycle_bytes: PositiveInt = Field(
        default=1024 * _MIB, description="Memory in use beyond which a free worker is replaced [bytes]."
    )
    verify_first: bool = Field(
        default=True, description="Verify and record the first grasp of every run behind its answer."
    )
    plan_deadline_s: PositiveFloat = Field(default=300.0, description="Longest time for one job [s].")
    inspection_deadline_s: PositiveFloat = Field(
        default=60.0, description="Longest time to check and prepare one uploaded file [s]."
    )
    hand_deadline_s: PositiveFloat = Field(
        default=300.0, description="Longest time to compile, draft, check or try one uploaded hand [s]."
    )
    picture_deadline_s: PositiveFloat = Field(
        default=60.0, description="Longest time for one picture, mesh file or set of parallel grasps [s]."
    )
    warm_deadline_s: PositiveFloat = Field(
        default=600.0, description="Longest time for a worker to start; the first compiles the kernels [s]."
    )
    worker_silence_s: PositiveFloat = Field(
        default=5.0, description="How long a worker process may be stopped by the system before it is replaced [s]."
    )
    stop_grace_s: float = Field(
        default=2.0, ge=0, description="How long running jobs may go on when the service is told to stop [s]."
    )
    drain_s: float = Field(
        default=0.0,
        ge=0,
        description="How long a service that was told to stop goes on answering, not ready any more, so that a load "
        "balancer sends requests elsewhere [s].",
    )
    keep_jobs_s: PositiveFloat = Field(default=90 * _DAY, description="How long ended jobs are kept [s].")
    keep_recordings_s: PositiveFloat = Field(
        default=30 * _DAY, description="How long the files of ended jobs are kept: pictures, traces, recordings [s]."
    )
    keep_recordings_bytes: PositiveInt = Field(
        default=20_480 * _MIB, description="Most that these files take in all; the oldest jobs' go first [bytes]."
    )
    keep_orphans_s: PositiveFloat = Field(
        default=60.0, description="How long files stay that belong to nothing in the tables any more [s]."
    )
    keep_objects_s: PositiveFloat = Field(
        default=365 * _DAY, description="How long an object is kept that nobody uploads or plans for [s]."
    )
    log_format: Literal["text", "json"] = Field(default="text", description="How log lines are written.")
    log_level: Literal["debug", "info", "warning", "error"] = Field(default="info", description="Least level logged.")
    otlp_endpoint: str | None = Field(
        default=None, description="OpenTelemetry collector to send traces to, such as http://127.0.0.1:4318/v1/traces."
    )

    @property
    def cluster(self) -> bool:
        """Whether several machines share the work."""
        return self.storage_url is not None

    @model_validator(mode="after")
    def _several_machines_share_tables(self) -> "ServiceSettings":
        if self.storage_url is not None and self.database_url is None:
            raise ValueError("FINGERSPLIT_STORAGE_URL is for several machines; give FINGERSPLIT_DATABASE_URL as well.")
        return self

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003 -- the library's signature
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Options, then the environment, then the file."""
        file = os.environ.get("FINGERSPLIT_CONFIG")
        sources = (init_settings, env_settings)
        return (*sources, TomlConfigSettingsSource(settings_cls, Path(file))) if file else sources


def is_address(host: str) -> bool:
    """Whether a host is given by its address and not by a name."""
    try:
        ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        return False
    return True


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach an address."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def settings_table() -> str:
    """Every setting with its variable, default and meaning, as Markdown."""
    lines = ["| variable | default | meaning |", "|---|---|---|"]
    for name, field in ServiceSettings.model_fields.items():
        default = {"workers": "2, or 1 on one core", "data_dir": "~/.local/share/fingersplit"}.get(name, field.default)
        shown = "none" if default in (None, ()) else str(default).lower() if isinstance(default, bool) else default
        lines.append(f"| `FINGERSPLIT_{name.upper()}` | {shown} | {field.description} |")
    return "\n".join(lines)
