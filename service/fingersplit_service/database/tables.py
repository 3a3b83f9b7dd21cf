"""The tables. A migration in ``migrations/versions`` goes with every change here.

Times are seconds since 1970, UTC; documents are JSON text. ``owner`` is the id of the API key a row belongs to.
"""

import sqlalchemy as sa

__all__ = [
    "QUEUED",
    "RUNNING",
    "agents",
    "api_keys",
    "dataset_rounds",
    "datasets",
    "grasp_outcomes",
    "hands",
    "jobs",
    "metadata",
    "objects",
    "parallel_grasp_sets",
    "results",
    "uploads",
    "usage",
]

metadata = sa.MetaData()

_Number = sa.BigInteger().with_variant(sa.Integer, "sqlite")  # only INTEGER counts up by itself in SQLite
_Id = sa.String(64)
_Time = sa.Float(53)

objects = sa.Table(
    "objects",
    metadata,
    sa.Column("number", _Number, primary_key=True, comment="order of acceptance"),
    sa.Column("owner", _Id, nullable=False),
    sa.Column("id", _Id, nullable=False),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("document", sa.Text, nullable=False, comment="ObjectInfo"),
    sa.Column("created_at", _Time, nullable=False),
    sa.Column("used_at", _Time, nullable=False, comment="last uploaded or planned for"),
    sa.Column("bytes", sa.BigInteger, nullable=False, server_default="0", comment="size of its shape's file"),
    sa.Index("ix_objects_owner_id", "owner", "id", unique=True),
    sa.Index("ix_objects_owner_number", "owner", "number"),
    sa.Index("ix_objects_id", "id"),
)

parallel_grasp_sets = sa.Table(
    "parallel_grasp_sets",
    metadata,
    sa.Column("number", _Number, primary_key=True),
    sa.Column("owner", _Id, nullable=False),
    sa.Column("object_id", _Id, nullable=False),
    sa.Column("id", _Id, nullable=False, unique=True),
    sa.Column("origin", sa.String(16), nullable=False),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("count", sa.Integer, nullable=False),
    sa.Column("created_at", _Time, nullable=False),
    sa.Column("document", sa.Text, nullable=False, comment="list of ParallelGrasp"),
    sa.Index("ix_parallel_grasp_sets_object", "owner", "object_id", "number"),
)

jobs = sa.Table(
    "jobs",
    metadata,
    sa.Column("number", _Number, primary_key=True, comment="order of acceptance"),
    sa.Column("id", _Id, nullable=False, unique=True),
    sa.Column("owner", _Id, nullable=False),
    sa.Column("object_id", _Id, nullable=False),
    sa.Column("object_name", sa.Text, nullable=False),
    sa.Column("hand", _Id, nullable=False),
    sa.Column("batch_id", _Id),
    sa.Column("state", sa.String(16), nullable=False),
    sa.Column("priority", sa.Integer, nullable=False),
    sa.Column("deadline_s", sa.Float(53)),
    sa.Column("attempts", sa.Integer, nullable=False, comment="times handed to a worker, counted before"),
    sa.Column("worker_deaths", sa.Integer, nullable=False, comment="times its worker died of it"),
    sa.Column("runner", _Id, comment="of several machines the one that runs it: agents.id"),
    sa.Column("abandoned", sa.Integer, nullable=False, server_default="0", comment="times its machine fell silent"),
    sa.Column("stage", sa.String(32), comment="what a job on another machine does"),
    sa.Column("progress", sa.Float(53), comment="how much of it is done"),
    sa.Column("created_at", _Time, nullable=False),
    sa.Column("started_at", _Time, comment="of the latest attempt"),
    sa.Column("finished_at", _Time),
    sa.Column("grasps", sa.Integer, comment="number of grasps in the result"),
    sa.Column("feasible", sa.Integer),
    sa.Column("verified", sa.Integer),
    sa.Column("holding_margin", sa.Float(53), comment="holding margin of rank 1 [N]"),
    sa.Column("error_code", sa.String(32)),
    sa.Column("error_detail", sa.Text),
    sa.Column("warnings", sa.Text, nullable=False, comment="list of sentences"),
    sa.Column("verification", sa.String(16), comment="of the first grasp behind the answer: pending, done, failed"),
    sa.Column("verification_attempts", sa.Integer, nullable=False, server_default="0"),
    sa.Column("verifier", _Id, comment="of several machines the one that verifies it: agents.id"),
    sa.Column("result_bytes", sa.BigInteger, nullable=False, server_default="0", comment="size of its result"),
    sa.Column("idempotency_key", sa.String(255)),
    sa.Column("request_hash", sa.String(64), nullable=False),
    sa.Column("request", sa.Text, nullable=False, comment="JobCreate"),
    sa.Index("ix_jobs_owner_number", "owner", "number"),
    sa.Index("ix_jobs_owner_state", "owner", "state", "number"),
    sa.Index("ix_jobs_owner_object", "owner", "object_id", "number"),
    *(
        sa.Index(name, *columns, sqlite_where=sa.text(of), postgresql_where=sa.text(of))
        for name, of, columns in (
            ("ix_jobs_queued", "state = 'queued'", ("owner", "priority", "number", "object_id")),
            ("ix_jobs_running", "state = 'running'", ("owner", "runner")),
        )
    ),
    sa.Index("ix_jobs_served", "owner", "started_at"),
    sa.Index("ix_jobs_batch", "batch_id", "number"),
    sa.Index("ix_jobs_finished", "finished_at"),
    sa.Index("ix_jobs_verification", "verification", "owner", "number"),
    sa.Index("ix_jobs_idempotency", "owner", "idempotency_key", unique=True),
)

QUEUED, RUNNING = (jobs.c.state == sa.literal_column(f"'{state}'") for state in ("queued", "running"))
"""Conditions on jobs, as text: with a parameter the database cannot know that it may use the index of these rows."""

results = sa.Table(
    "results",
    metadata,
    sa.Column("job_id", _Id, sa.ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True),
    sa.Column("document", sa.Text, nullable=False, comment="PlanResult; apart, so that lists do not read over it"),
)

grasp_outcomes = sa.Table(  # without a reference to jobs: what a robot found out outlives them
    "grasp_outcomes",
    metadata,
    sa.Column("number", _Number, primary_key=True, comment="order of arrival"),
    sa.Column("id", _Id, nullable=False, unique=True),
    sa.Column("owner", _Id, nullable=False),
    sa.Column("job_id", _Id, nullable=False),
    sa.Column("rank", sa.Integer, nullable=False),
    sa.Column("object_id", _Id, nullable=False),
    sa.Column("hand", _Id, nullable=False),
    sa.Column("held", sa.Boolean, nullable=False),
    sa.Column("p_hold", sa.Float(53)),
    sa.Column("document", sa.Text, nullable=False, comment="GraspOutcome"),
    sa.Column("grasp", sa.Text, nullable=False, comment="palm and joints as they were planned"),
    sa.Index("ix_grasp_outcomes_owner_number", "owner", "number"),
    sa.Index("ix_grasp_outcomes_owner_job", "owner", "job_id", "number"),
)

uploads = sa.Table(
    "uploads",
    metadata,
    sa.Column("owner", _Id, primary_key=True),
    sa.Column("key", _Id, primary_key=True, comment="hash of a file and of what was said of it"),
    sa.Column("object_id", _Id, nullable=False),
    sa.Index("ix_uploads_object", "owner", "object_id"),
)

agents = sa.Table(
    "agents",
    metadata,
    sa.Column("id", _Id, primary_key=True),
    sa.Column("name", sa.Text, nullable=False, comment="machine and process, for people"),
    sa.Column("workers", sa.Integer, nullable=False),
    sa.Column("started_at", _Time, nullable=False),
    sa.Column("beat_at", _Time, nullable=False, comment="last sign of life, by the database's clock"),
)

usage = sa.Table(
    "usage",
    metadata,
    sa.Column("owner", _Id, primary_key=True),
    sa.Column("kind", sa.String(16), primary_key=True, comment="jobs a minute, cpu_s a day"),
    sa.Column("start", sa.BigInteger, primary_key=True, autoincrement=False, comment="of the time it counts for"),
    sa.Column("amount", sa.Float(53), nullable=False),
)

hands = sa.Table(
    "hands",
    metadata,
    sa.Column("number", _Number, primary_key=True, comment="order of acceptance"),
    sa.Column("owner", _Id, nullable=False),
    sa.Column("id", _Id, nullable=False),
    sa.Column("document", sa.Text, nullable=False, comment="HandInfo"),
    sa.Column("created_at", _Time, nullable=False),
    sa.Column("bytes", sa.BigInteger, nullable=False, server_default="0", comment="size of its file"),
    sa.Index("ix_hands_owner_id", "owner", "id", unique=True),
    sa.Index("ix_hands_id", "id"),
)

datasets = sa.Table(
    "datasets",
    metadata,
    sa.Column("number", _Number, primary_key=True, comment="order of acceptance"),
    sa.Column("owner", _Id, nullable=False),
    sa.Column("id", _Id, nullable=False, unique=True, comment="also the batch of the jobs that fill it"),
    sa.Column("state", sa.String(16), nullable=False, comment="running, complete, cancelled"),
    sa.Column("request", sa.Text, nullable=False, comment="DatasetCreate"),
    sa.Column("objects", sa.Text, nullable=False, comment="list of index, id, name, split"),
    sa.Column("created_at", _Time, nullable=False),
    sa.Column("finished_at", _Time),
    sa.Index("ix_datasets_owner_number", "owner", "number"),
    sa.Index("ix_datasets_state", "state"),
)

dataset_rounds = sa.Table(
    "dataset_rounds",
    metadata,
    sa.Column("dataset_id", _Id, primary_key=True),
    sa.Column("object_index", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("round", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("job_id", _Id, nullable=False),
    sa.Column("missing", sa.Integer, nullable=False, comment="grasps that were missing when it began"),
    sa.Column("state", sa.String(16), nullable=False, comment="open, planned, failed"),
    *(sa.Column(name, sa.Integer, nullable=False) for name in ("grasps", "feasible", "held", "selected")),
    sa.Column("error_code", sa.String(32)),
    sa.Column("error_detail", sa.Text),
)

api_keys = sa.Table(
    "api_keys",
    metadata,
    sa.Column("id", _Id, primary_key=True),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("hash", sa.String(64), nullable=False, comment="SHA-256 of the secret, which is 256 random bits"),
    sa.Column("scopes", sa.String(64), nullable=False, comment="space-separated"),
    sa.Column("created_at", _Time, nullable=False),
    sa.Column("revoked_at", _Time),
)
