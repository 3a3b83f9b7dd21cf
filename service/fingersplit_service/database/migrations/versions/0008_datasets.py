"""Data sets and the rounds that were planned for them."""

import sqlalchemy as sa
from alembic import op

__all__ = ["downgrade", "upgrade"]

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    """Make the tables, empty."""
    op.create_table(
        "datasets",
        sa.Column("number", sa.BigInteger().with_variant(sa.Integer, "sqlite"), primary_key=True),
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("id", sa.String(64), nullable=False, unique=True),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("request", sa.Text, nullable=False),
        sa.Column("objects", sa.Text, nullable=False),
        sa.Column("created_at", sa.Float(53), nullable=False),
        sa.Column("finished_at", sa.Float(53)),
    )
    op.create_index("ix_datasets_owner_number", "datasets", ["owner", "number"])
    op.create_index("ix_datasets_state", "datasets", ["state"])
    op.create_table(
        "dataset_rounds",
        sa.Column("dataset_id", sa.String(64), primary_key=True),
        sa.Column("object_index", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("round", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("job_id", sa.String(64), nullable=False),
        sa.Column("missing", sa.Integer, nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        *(sa.Column(name, sa.Integer, nullable=False) for name in ("grasps", "feasible", "held", "selected")),
        sa.Column("error_code", sa.String(32)),
        sa.Column("error_detail", sa.Text),
    )


def downgrade() -> None:
    """Drop the tables."""
    op.drop_table("dataset_rounds")
    op.drop_table("datasets")
