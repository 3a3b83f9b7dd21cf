"""Brings the tables of a database up to date with Alembic."""

from pathlib import Path

import sqlalchemy as sa

__all__ = ["HEAD", "schema_version", "upgrade_schema"]

HEAD = "0001"
"""The newest migration; a test holds it against ``migrations/versions``."""


def schema_version(engine: sa.Engine) -> str | None:
    """The migration that a database has; None for an empty one."""
    with engine.connect() as connection:
        if not sa.inspect(connection).has_table("alembic_version"):
            return None
        version: str | None = connection.exec_driver_sql("SELECT version_num FROM alembic_version").scalar()
        return version


def upgrade_schema(engine: sa.Engine) -> None:
    """Run the migrations that a database lacks."""
    if schema_version(engine) == HEAD:
        return
    # Imported here, because it takes longer than everything else and is hardly ever needed.
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(Path(__file__).with_name("migrations")).replace("%", "%%"))
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
