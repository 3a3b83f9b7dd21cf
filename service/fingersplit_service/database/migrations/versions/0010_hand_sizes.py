"""How much the files of uploaded hands take, which owners' limits count."""

import sqlalchemy as sa
from alembic import op

__all__ = ["downgrade", "upgrade"]

revision = "0010"
down_revision = "0009"


def upgrade() -> None:
    """Add the column; hands of before count nothing."""
    op.add_column("hands", sa.Column("bytes", sa.BigInteger(), nullable=False, server_default="0"))


def downgrade() -> None:
    """Drop it."""
    op.execute("ALTER TABLE hands DROP COLUMN bytes")
