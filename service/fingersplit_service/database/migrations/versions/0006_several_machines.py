"""Several machines: who runs a job, signs of life, and what each owner uses."""

import sqlalchemy as sa
from alembic import op

__all__ = ["downgrade", "upgrade"]

revision = "0006"
down_revision = "0005"

_OF_JOBS = ("runner", "abandoned", "stage", "progress", "verifier", "result_bytes")


def upgrade() -> None:
    """Add columns and tables; the sizes of older results are read from them."""
    op.add_column("objects", sa.Column("bytes", sa.BigInteger(), nullable=False, server_default="0"))
    op.add_column("jobs", sa.Column("runner", sa.String(64)))
    op.add_column("jobs", sa.Column("abandoned", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("jobs", sa.Column("stage", sa.String(32)))
    op.add_column("jobs", sa.Column("progress", sa.Float(53)))
    op.add_column("jobs", sa.Column("verifier", sa.String(64)))
    op.add_column("jobs", sa.Column("result_bytes", sa.BigInteger(), nullable=False, server_default="0"))
    size = "SELECT length(results.document) FROM results WHERE results.job_id = jobs.id"
    op.execute(f"UPDATE jobs SET result_bytes = COALESCE(({size}), 0)")
    op.create_index("ix_jobs_waiting", "jobs", ["state", "owner", "priority", "number"])
    op.create_index("ix_jobs_served", "jobs", ["owner", "started_at"])
    op.create_table(
        "agents",
        sa.Column("id", sa.String(64), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("workers", sa.Integer(), nullable=False),
        sa.Column("started_at", sa.Float(53), nullable=False),
        sa.Column("beat_at", sa.Float(53), nullable=False),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_table(
        "usage",
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("start", sa.BigInteger(), nullable=False),
        sa.Column("amount", sa.Float(53), nullable=False),
        sa.PrimaryKeyConstraint("owner", "kind", "start"),
    )


def downgrade() -> None:
    """Drop them."""
    for table in ("usage", "agents"):
        op.drop_table(table)
    for index in ("ix_jobs_served", "ix_jobs_waiting"):
        op.drop_index(index, "jobs")
    for column in _OF_JOBS:
        op.execute(f"ALTER TABLE jobs DROP COLUMN {column}")
    op.execute("ALTER TABLE objects DROP COLUMN bytes")
