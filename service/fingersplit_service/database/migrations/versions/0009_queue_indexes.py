"""Indexes that are the right ones whatever the database knows of how many rows there are."""

import sqlalchemy as sa
from alembic import op

__all__ = ["downgrade", "upgrade"]

revision = "0009"
down_revision = "0008"


def upgrade() -> None:
    """Index the jobs that wait and those that run alone."""
    for index in ("ix_jobs_queue", "ix_jobs_waiting"):
        op.drop_index(index, "jobs")
    queued, running = (sa.text(f"state = '{state}'") for state in ("queued", "running"))
    for name, where, columns in (
        ("ix_jobs_queued", queued, ["owner", "priority", "number", "object_id"]),
        ("ix_jobs_running", running, ["owner", "runner"]),
    ):
        op.create_index(name, "jobs", columns, sqlite_where=where, postgresql_where=where)


def downgrade() -> None:
    """Have the old ones again."""
    for index in ("ix_jobs_queued", "ix_jobs_running"):
        op.drop_index(index, "jobs")
    op.create_index("ix_jobs_queue", "jobs", ["state", "priority", "owner", "number"])
    op.create_index("ix_jobs_waiting", "jobs", ["state", "owner", "priority", "number"])
