"""What was accepted and what became of it: tables in SQLite or PostgreSQL, and one class for each subject."""
