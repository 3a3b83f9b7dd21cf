"""The subcommand `fingersplit serve`."""

import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = ["serve"]

_GRACE = 10  # for answers under way when the service is told to stop [s]


def serve(
    host: Annotated[
        str | None, typer.Option(help="Address to listen on; loopback only.", show_default="127.0.0.1")
    ] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on.", show_default="8000")] = None,
    workers: Annotated[int | None, typer.Option(help="Number of worker processes.", show_default="2")] = None,
    data_dir: Annotated[Path | None, typer.Option(help="Where all data are kept.")] = None,
) -> None:
    """Serve grasp planning over HTTP until interrupted.

    Every option can also be set in the environment: FINGERSPLIT_HOST, FINGERSPLIT_PORT, FINGERSPLIT_WORKERS,
    FINGERSPLIT_DATA_DIR.
    """
    # Imported here, because every `fingersplit` command loads this module.
    import uvicorn
    from pydantic import ValidationError

    from fingersplit_service.app import create_app
    from fingersplit_service.settings import ServiceSettings

    options: dict[str, Any] = {"host": host, "port": port, "workers": workers, "data_dir": data_dir}
    try:
        settings = ServiceSettings(**{name: value for name, value in options.items() if value is not None})
    except ValidationError as error:
        for one in error.errors():
            where = " ".join(f"{part}:" for part in one["loc"])
            typer.echo(f"{where} {one['msg'].removeprefix('Value error, ')}".lstrip(), err=True)
        raise typer.Exit(2) from None
    sys.stdout.write(f"Fingersplit: http://{settings.host}:{settings.port}/docs, data in {settings.data_dir}\n")
    sys.stdout.flush()
    config = uvicorn.Config(
        create_app(settings),
        host=settings.host,
        port=settings.port,
        log_level="info",
        timeout_graceful_shutdown=_GRACE,
    )
    with suppress(KeyboardInterrupt):  # uvicorn repeats the signal once it has stopped cleanly
        uvicorn.Server(config).run()
