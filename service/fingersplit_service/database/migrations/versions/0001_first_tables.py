"""The first tables."""

import sqlalchemy as sa
from alembic import op

__all__ = ["downgrade", "upgrade"]

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Make every table."""
    number = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    time = sa.Float(53)
    op.create_table(
        "api_keys",
        sa.Column("id", sa.String(64), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("hash", sa.String(64), nullable=False),
        sa.Column("scopes", sa.String(64), nullable=False),
        sa.Column("created_at", time, nullable=False),
        sa.Column("revoked_at", time),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_table(
        "jobs",
        sa.Column("number", number, nullable=False),
        sa.Column("id", sa.String(64), nullable=False),
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("object_id", sa.String(64), nullable=False),
        sa.Column("object_name", sa.Text(), nullable=False),
        sa.Column("hand", sa.String(64), nullable=False),
        sa.Column("batch_id", sa.String(64)),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("deadline_s", time),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("worker_deaths", sa.Integer(), nullable=False),
        sa.Column("runner", sa.String(64)),
        sa.Column("lease_until", time),
        sa.Column("created_at", time, nullable=False),
        sa.Column("started_at", time),
        sa.Column("finished_at", time),
        sa.Column("grasps", sa.Integer()),
        sa.Column("feasible", sa.Integer()),
        sa.Column("verified", sa.Integer()),
        sa.Column("holding_margin", time),
        sa.Column("error_code", sa.String(32)),
        sa.Column("error_detail", sa.Text()),
        sa.Column("warnings", sa.Text(), nullable=False),
        sa.Column("idempotency_key", sa.String(255)),
        sa.Column("request_hash", sa.String(64), nullable=False),
        sa.Column("request", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("number"),
        sa.UniqueConstraint("id"),
    )
    op.create_index("ix_jobs_batch", "jobs", ["batch_id", "number"])
    op.create_index("ix_jobs_finished", "jobs", ["finished_at"])
    op.create_index("ix_jobs_idempotency", "jobs", ["owner", "idempotency_key"], unique=True)
    op.create_index("ix_jobs_owner_number", "jobs", ["owner", "number"])
    op.create_index("ix_jobs_owner_object", "jobs", ["owner", "object_id", "number"])
    op.create_index("ix_jobs_owner_state", "jobs", ["owner", "state", "number"])
    op.create_index("ix_jobs_queue", "jobs", ["state", "priority", "owner", "number"])
    op.create_table(
        "objects",
        sa.Column("number", number, nullable=False),
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("id", sa.String(64), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("document", sa.Text(), nullable=False),
        sa.Column("created_at", time, nullable=False),
        sa.Column("used_at", time, nullable=False),
        sa.PrimaryKeyConstraint("number"),
    )
    op.create_index("ix_objects_id", "objects", ["id"])
    op.create_index("ix_objects_owner_id", "objects", ["owner", "id"], unique=True)
    op.create_index("ix_objects_owner_number", "objects", ["owner", "number"])
    op.create_table(
        "parallel_grasp_sets",
        sa.Column("number", number, nullable=False),
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("object_id", sa.String(64), nullable=False),
        sa.Column("id", sa.String(64), nullable=False),
        sa.Column("origin", sa.String(16), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("created_at", time, nullable=False),
        sa.Column("document", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("number"),
        sa.UniqueConstraint("id"),
    )
    op.create_index("ix_parallel_grasp_sets_object", "parallel_grasp_sets", ["owner", "object_id", "number"])
    op.create_table(
        "results",
        sa.Column("job_id", sa.String(64), nullable=False),
        sa.Column("document", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("job_id"),
    )


def downgrade() -> None:
    """Drop every table."""
    for table in ("results", "parallel_grasp_sets", "objects", "jobs", "api_keys"):
        op.drop_table(table)
