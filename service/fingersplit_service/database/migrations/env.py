"""What Alembic runs: the migrations, on the connection that the service gives; nothing when merely imported."""

from alembic import context

from fingersplit_service.database.tables import metadata

if hasattr(context, "config"):
    connection = context.config.attributes["connection"]
    context.configure(connection=connection, target_metadata=metadata, render_as_batch=True)
    with context.begin_transaction():
        context.run_migrations()
