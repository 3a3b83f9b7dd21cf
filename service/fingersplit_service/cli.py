"""The subcommands `fingersplit serve`, `worker`, `keys`, `data` and `doctor`."""

import asyncio
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from fingersplit_service.database.keys import KeyStore
    from fingersplit_service.settings import ServiceSettings

__all__ = [
    "create_key",
    "data",
    "doctor",
    "export_archive",
    "import_archive",
    "keys",
    "list_keys",
    "revoke_key",
    "serve",
    "worker",
]

_BAD_INPUT = 2
_DATABASE_RETRY = 0.5  # between attempts to open a database that does not answer yet [s]

DataDirectory = Annotated[Path | None, typer.Option(help="Where all data are kept.")]

data = typer.Typer(no_args_is_help=True, help="Move everything that a service keeps to another one.")
keys = typer.Typer(no_args_is_help=True, help="Create, list and revoke the API keys of the service.")


def serve(
    host: Annotated[
        str | None, typer.Option(help="Address to listen on; beyond loopback with keys.", show_default="127.0.0.1")
    ] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on.", show_default="8000")] = None,
    workers: Annotated[int | None, typer.Option(help="Number of worker processes.", show_default="2")] = None,
    data_dir: DataDirectory = None,
    show_settings: Annotated[bool, typer.Option("--show-settings", help="Print every setting and end.")] = False,
) -> None:
    """Serve grasp planning over HTTP until interrupted.

    Every setting can also be given in the environment, such as FINGERSPLIT_PORT, or in a TOML file that
    FINGERSPLIT_CONFIG names; --show-settings lists them.
    """
    # Imported here, because every `fingersplit` command loads this module.
    from fingersplit_service.app import create_app
    from fingersplit_service.listening import serve_app
    from fingersplit_service.settings import settings_table

    if show_settings:
        typer.echo(settings_table())
        return
    settings = _settings(host=host, port=port, workers=workers, data_dir=data_dir)
    _refuse_start(settings)
    kept = "PostgreSQL and the object store" if settings.cluster else settings.data_dir
    sys.stdout.write(f"Fingersplit: http://{settings.host}:{settings.port}/docs, data in {kept}\n")
    sys.stdout.flush()
    serve_app(create_app(settings), settings)


def worker(
    host: Annotated[
        str | None, typer.Option(help="Address of /healthz, /readyz and /metrics.", show_default="127.0.0.1")
    ] = None,
    port: Annotated[int | None, typer.Option(help="Port of these.", show_default="8000")] = None,
    workers: Annotated[int | None, typer.Option(help="Number of worker processes.", show_default="2")] = None,
    data_dir: DataDirectory = None,
) -> None:
    """Run jobs that `fingersplit serve` accepted on other machines, until interrupted.

    FINGERSPLIT_DATABASE_URL and FINGERSPLIT_STORAGE_URL name what the machines share; the data directory holds copies
    that may be deleted.
    """
    from fingersplit_service.app import create_worker_app
    from fingersplit_service.listening import serve_app

    settings = _settings(host=host, port=port, workers=workers, data_dir=data_dir)
    if not settings.cluster:
        typer.echo(
            "A worker needs what it shares with other machines: set FINGERSPLIT_DATABASE_URL and "
            "FINGERSPLIT_STORAGE_URL; one machine alone only needs `fingersplit serve`.",
            err=True,
        )
        raise typer.Exit(_BAD_INPUT)
    _refuse_start(settings)
    sys.stdout.write(f"Fingersplit worker: {settings.workers} processes, http://{settings.host}:{settings.port}\n")
    sys.stdout.flush()
    serve_app(create_worker_app(settings), settings)


def _refuse_start(settings: "ServiceSettings") -> None:
    """End the program with a sentence where a service could not start with these settings."""
    from fingersplit_service.database.connection import StorageUnavailable
    from fingersplit_service.database.schema import SchemaTooNew
    from fingersplit_service.operations.exposure import Exposed, refuse_exposure
    from fingersplit_service.storage import DataDirectoryInUse, Storage

    try:
        with _key_store_in_time(settings) as store:
            asyncio.run(refuse_exposure(settings, store))
        with Storage(settings.data_dir.absolute()).lock():
            pass
        if settings.cluster:
            import obstore  # noqa: F401 -- of an extra
    except (Exposed, DataDirectoryInUse, SchemaTooNew, StorageUnavailable, OSError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(_BAD_INPUT) from None
    except ModuleNotFoundError as error:
        typer.echo(f"{error.name} is missing; install fingersplit-service[cluster].", err=True)
        raise typer.Exit(_BAD_INPUT) from None


@keys.command("create")
def create_key(
    name: Annotated[str, typer.Argument(help="Whose key it is, for people.")],
    scopes: Annotated[str, typer.Option(help="What it may do: read, plan, admin, separated by commas.")] = "read,plan",
    data_dir: DataDirectory = None,
) -> None:
    """Create a key and print it; it cannot be shown again."""
    from fingersplit_service.database.keys import SCOPES

    wanted = [scope for scope in SCOPES if scope in scopes.split(",")]
    unknown = set(scopes.split(",")) - set(SCOPES)
    if unknown or not wanted:
        typer.echo(f"Unknown scopes: {', '.join(sorted(unknown))}; known: {', '.join(SCOPES)}.", err=True)
        raise typer.Exit(_BAD_INPUT)
    with _key_store(_settings(data_dir=data_dir)) as store:
        typer.echo(asyncio.run(store.create(name, wanted)))


@keys.command("list")
def list_keys(data_dir: DataDirectory = None) -> None:
    """List the keys, without their secrets."""
    from datetime import UTC, datetime

    with _key_store(_settings(data_dir=data_dir)) as store:
        rows = asyncio.run(store.all())
    for row in rows:
        made = datetime.fromtimestamp(row.created_at, UTC)
        state = "active" if row.revoked_at is None else "revoked"
        typer.echo(f"{row.id}  {state:7}  {made:%Y-%m-%d %H:%M} UTC  {','.join(row.scopes):15}  {row.name}")


@keys.command("revoke")
def revoke_key(
    key_id: Annotated[str, typer.Argument(help="Id of the key, as `fingersplit keys list` shows it.")],
    data_dir: DataDirectory = None,
) -> None:
    """End a key; a running service refuses it within a second."""
    with _key_store(_settings(data_dir=data_dir)) as store:
        if not asyncio.run(store.revoke(key_id)):
            typer.echo(f"There is no active key {key_id!r}; see `fingersplit keys list`.", err=True)
            raise typer.Exit(_BAD_INPUT)


@data.command("export")
def export_archive(
    archive: Annotated[Path, typer.Argument(help="The tar file to write.")], data_dir: DataDirectory = None
) -> None:
    """Write everything that a service keeps to an archive; one machine's service must be stopped."""
    from fingersplit_service.operations.transfer import export_data

    with _faults_as_messages():
        done = export_data(_settings(data_dir=data_dir), archive)
    typer.echo(f"{done.rows} rows and {done.files} files.")


@data.command("import")
def import_archive(
    archive: Annotated[Path, typer.Argument(help="The tar file that `fingersplit data export` wrote.")],
    local_to: Annotated[
        str | None, typer.Option(help="Id of the key that gets what was made while there were no keys.")
    ] = None,
    data_dir: DataDirectory = None,
) -> None:
    """Add everything of an archive to a service; what is there stays, so it can be repeated."""
    from fingersplit_service.operations.transfer import import_data

    with _faults_as_messages():
        done = import_data(_settings(data_dir=data_dir), archive, local_to)
    typer.echo(f"{done.rows} rows and {done.files} files were added.")


@contextmanager
def _faults_as_messages() -> Iterator[None]:
    """End the program with a sentence where data cannot be read or written."""
    from fingersplit_service.database.connection import DatabaseInUse, StorageUnavailable
    from fingersplit_service.database.schema import SchemaTooNew
    from fingersplit_service.operations.transfer import ArchiveError
    from fingersplit_service.storage import DataDirectoryInUse

    try:
        yield
    except (ArchiveError, DataDirectoryInUse, DatabaseInUse, SchemaTooNew, StorageUnavailable, OSError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(_BAD_INPUT) from None


def doctor(data_dir: DataDirectory = None) -> None:
    """Check this installation and say what is wrong; the exit code is 1 when something is."""
    from fingersplit_service.operations.doctor import examine

    checks = examine(_settings(data_dir=data_dir))
    for check in checks:
        typer.echo(f"{'ok   ' if check.fine else 'WRONG'}  {check.what}: {check.detail}")
    if not all(check.fine for check in checks):
        raise typer.Exit(1)


def _settings(**options: Any) -> "ServiceSettings":
    """The settings; ends the program with a sentence for each that is not valid."""
    from pydantic import ValidationError
    from pydantic_settings import SettingsError

    from fingersplit_service.settings import ServiceSettings

    try:
        return ServiceSettings(**{name: value for name, value in options.items() if value is not None})
    except ValidationError as error:
        for one in error.errors():
            where = " ".join(f"{part}:" for part in one["loc"])
            typer.echo(f"{where} {one['msg'].removeprefix('Value error, ')}".lstrip(), err=True)
        raise typer.Exit(_BAD_INPUT) from None
    except SettingsError as error:  # a list out of the environment
        name = str(error).partition('field "')[2].partition('"')[0]
        typer.echo(f'{name}: It must be a JSON list in the environment, such as ["a", "b"].', err=True)
        raise typer.Exit(_BAD_INPUT) from None


@contextmanager
def _key_store_in_time(settings: "ServiceSettings") -> Iterator["KeyStore"]:
    """Like `_key_store`, once the database answers, which may be starting as well."""
    from fingersplit_service.database.connection import StorageUnavailable

    end = time.monotonic() + (settings.database_wait_s if settings.database_url else 0.0)
    with ExitStack() as stack:
        told = False
        while True:
            try:
                store = stack.enter_context(_key_store(settings))
                break
            except StorageUnavailable as error:
                if time.monotonic() >= end:
                    raise
                if not told:
                    typer.echo(f"{error}\nIt is tried again for {settings.database_wait_s:g} s.", err=True)
                told = True
                time.sleep(_DATABASE_RETRY)
        yield store


@contextmanager
def _key_store(settings: "ServiceSettings") -> Iterator["KeyStore"]:
    """The keys of a data directory or database, opened."""
    from fingersplit_service.database.connection import Database, database_url
    from fingersplit_service.database.keys import KeyStore
    from fingersplit_service.storage import Storage

    settings.data_dir.mkdir(parents=True, exist_ok=True)
    database = Database(database_url(settings.database_url, Storage(settings.data_dir).database))
    try:
        yield KeyStore(database)
    finally:
        database.close()
