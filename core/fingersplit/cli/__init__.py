"""The ``fingersplit`` program; other distributions add commands through the entry point ``fingersplit.commands``."""

from fingersplit.cli.main import main

__all__ = ["main"]
