"""Limits that hold in the server and in the application."""

__all__ = ["MAX_HEADER_BYTES"]

MAX_HEADER_BYTES = 64 * 1024
"""Largest headers of a request, its first line included."""
