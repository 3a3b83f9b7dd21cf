"""Log lines that say which request and which job they are about."""

import json
import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Literal

__all__ = ["configure_logs", "log_context"]

_context: ContextVar[dict[str, str] | None] = ContextVar("log_context", default=None)


@contextmanager
def log_context(**members: str) -> Iterator[None]:
    """Have every line that is logged inside carry these members, such as ``job_id``."""
    token = _context.set({**(_context.get() or {}), **members})
    try:
        yield
    finally:
        _context.reset(token)


class _Json(logging.Formatter):
    """One JSON object a line."""

    def format(self, record: logging.LogRecord) -> str:
        line = {
            "time": f"{self.formatTime(record, '%Y-%m-%dT%H:%M:%S')}.{int(record.msecs):03d}Z",
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **(_context.get() or {}),
        }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line)


class _Text(logging.Formatter):
    """A line for people, with the members at its end."""

    def format(self, record: logging.LogRecord) -> str:
        members = "".join(f" {name}={value}" for name, value in (_context.get() or {}).items())
        time_of_day = self.formatTime(record, "%H:%M:%S")
        text = f"{time_of_day} {record.levelname.lower()} {_one_line(record.getMessage())}{members}"
        return f"{text}\n{self.formatException(record.exc_info)}" if record.exc_info else text


def configure_logs(log_format: Literal["text", "json"], level: str) -> None:
    """Send all log lines of this process to standard error."""
    formatter = _Json() if log_format == "json" else _Text()
    formatter.converter = time.gmtime
    handler = logging.StreamHandler()
    handler.setFormatter(formatter)
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)
    for noisy in ("alembic", "uvicorn.access"):
        logging.getLogger(noisy).setLevel(logging.WARNING)


def _one_line(text: str) -> str:
    """What came from outside must not be able to look like another line, or to steer a terminal."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
