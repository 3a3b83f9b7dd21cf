"""Sessions of browsers: a random token in a cookie stands for an API key."""

import secrets
import time

__all__ = ["LIFETIME", "SESSION_COOKIE", "Sessions"]

SESSION_COOKIE = "fingersplit_session"
LIFETIME = 12 * 3_600.0  # [s]
_MAX_OPEN = 10_000


class Sessions:
    """Open sessions, kept in memory: they end with the service."""

    def __init__(self) -> None:
        self._open: dict[str, tuple[str, float]] = {}

    def begin(self, key_id: str) -> str:
        """Open a session for a key; its token."""
        now = time.monotonic()
        self._open = {token: one for token, one in self._open.items() if one[1] > now}
        while len(self._open) >= _MAX_OPEN:
            del self._open[next(iter(self._open))]
        token = secrets.token_urlsafe(32)
        self._open[token] = (key_id, now + LIFETIME)
        return token

    def key_of(self, token: str) -> str | None:
        """Id of the key that a session stands for; None when it has ended."""
        key_id, end = self._open.get(token, (None, 0.0))
        return key_id if time.monotonic() < end else None

    def end(self, token: str) -> None:
        """Close a session."""
        self._open.pop(token, None)
