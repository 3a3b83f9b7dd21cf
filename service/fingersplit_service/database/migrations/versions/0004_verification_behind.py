"""Whether the first grasp of a run is verified behind its answer."""

import sqlalchemy as sa
from alembic import op

__all__ = ["downgrade", "upgrade"]

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Add the columns; runs of before stay as they are."""
    op.add_column("jobs", sa.Column("verification", sa.String(16)))
    op.add_column("jobs", sa.Column("verification_attempts", sa.Integer(), nullable=False, server_default="0"))
    op.create_index("ix_jobs_verification", "jobs", ["verification", "owner", "number"])


def downgrade() -> None:
    """Drop the columns."""
    op.drop_index("ix_jobs_verification", "jobs")
    for column in ("verification", "verification_attempts"):
        op.execute(f"ALTER TABLE jobs DROP COLUMN {column}")
