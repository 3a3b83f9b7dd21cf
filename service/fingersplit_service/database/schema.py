"""Brings the tables of a database up to date with Alembic."""

from pathlib import Path

import sqlalchemy as sa

__all__ = ["HEAD", "SchemaTooNew", "schema_version", "upgrade_schema"]

HEAD = "0010"
"""The newest migration; a test holds it against ``migrations/versions``."""
_UPGRADE_LOCK = 0x66696E68  # of PostgreSQL, held while one of several processes upgrades


class SchemaTooNew(Exception):  # noqa: N818
    """A newer version of the program has changed the tables."""


def schema_version(engine: sa.Engine) -> str | None:
    """The migration that a database has; None for an empty one."""
    with engine.connect() as connection:
        return _version(connection)


def upgrade_schema(engine: sa.Engine) -> None:
    """Run the migrations that a database lacks; several processes may call it at once.

    Raises:
        SchemaTooNew: The tables are those of a newer version.
    """
    if schema_version(engine) == HEAD:
        return
    # Imported here, because it takes longer than everything else and is hardly ever needed.
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(Path(__file__).with_name("migrations")).replace("%", "%%"))
    with engine.begin() as connection:  # SQLite's transactions begin with the write lock
        if engine.dialect.name == "postgresql":
            connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_UPGRADE_LOCK)))
        version = _version(connection)
        if version is not None and version > HEAD:
            raise SchemaTooNew(
                f"The tables have version {version}, and this program knows {HEAD}; use the newer program again, or "
                f"restore a backup that was made before it was upgraded."
            )
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def _version(connection: sa.Connection) -> str | None:
    if not sa.inspect(connection).has_table("alembic_version"):
        return None
    version: str | None = connection.exec_driver_sql("SELECT version_num FROM alembic_version").scalar()
    return version
