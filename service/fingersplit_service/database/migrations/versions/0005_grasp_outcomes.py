"""What robots report of planned grasps."""

import sqlalchemy as sa
from alembic import op

__all__ = ["downgrade", "upgrade"]

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """Create the table."""
    number = sa.BigInteger().with_variant(sa.Integer, "sqlite")
    op.create_table(
        "grasp_outcomes",
        sa.Column("number", number, primary_key=True),
        sa.Column("id", sa.String(64), nullable=False, unique=True),
        *(sa.Column(name, sa.String(64), nullable=False) for name in ("owner", "job_id", "object_id", "hand")),
        sa.Column("rank", sa.Integer, nullable=False),
        sa.Column("held", sa.Boolean, nullable=False),
        sa.Column("p_hold", sa.Float(53)),
        sa.Column("document", sa.Text, nullable=False),
        sa.Column("grasp", sa.Text, nullable=False),
    )
    op.create_index("ix_grasp_outcomes_owner_number", "grasp_outcomes", ["owner", "number"])
    op.create_index("ix_grasp_outcomes_owner_job", "grasp_outcomes", ["owner", "job_id", "number"])


def downgrade() -> None:
    """Drop it."""
    op.drop_table("grasp_outcomes")
