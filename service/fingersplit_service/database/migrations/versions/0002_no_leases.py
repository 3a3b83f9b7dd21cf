"""Jobs without runner and lease: one process runs all jobs of a database."""

import sqlalchemy as sa
from alembic import op

__all__ = ["downgrade", "upgrade"]

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Drop the columns."""
    for column in ("runner", "lease_until"):
        op.execute(f"ALTER TABLE jobs DROP COLUMN {column}")  # known to SQLite since 3.35


def downgrade() -> None:
    """Add the columns, empty."""
    op.add_column("jobs", sa.Column("runner", sa.String(64)))
    op.add_column("jobs", sa.Column("lease_until", sa.Float(53)))
