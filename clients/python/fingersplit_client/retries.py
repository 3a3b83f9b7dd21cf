"""How requests that failed on their way are repeated."""

import random
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime

import httpx2

__all__ = ["Retries", "retry_after"]

_MAY_PASS = frozenset({429, 502, 503, 504})
"""Answers that say nothing was done, and that it may work later."""


@dataclass(frozen=True)
class Retries:
    """How often a request is repeated and how long the pauses are.

    A request is repeated when the service, or something before it, answers 429, 502, 503 or 504, and when its
    connection breaks; what is not safe to send twice only when it cannot have arrived. Pauses double and are drawn at
    random, so that clients which failed together do not come back together; ``Retry-After`` makes them longer.

    Attributes:
        attempts: How often a request is sent at most; 1 repeats nothing.
        pause: Upper bound of the first pause [s]; doubled for each further one.
        longest_pause: Longest pause, also where the service asks for a longer one; then the error comes at once [s].
    """

    attempts: int = 5
    pause: float = 0.25
    longest_pause: float = 30.0

    def __post_init__(self) -> None:
        if self.attempts < 1 or self.pause < 0 or self.longest_pause < 0:
            raise ValueError(f"{self}: attempts must be 1 or more, pauses 0 or more.")

    def backoff(self, attempt: int) -> float:
        """Random pause after the attempt of this number, from 0 [s]."""
        return random.uniform(0.0, min(self.longest_pause, self.pause * 2.0**attempt))

    def pause_after_answer(self, response: httpx2.Response, attempt: int) -> float | None:
        """Pause before a refused request is sent again [s]; None when it must not be."""
        if response.status_code not in _MAY_PASS or attempt + 1 >= self.attempts:
            return None
        asked = retry_after(response) or 0.0
        return None if asked > self.longest_pause else asked + self.backoff(attempt)

    def pause_after_failure(self, error: httpx2.TransportError, attempt: int, repeatable: bool) -> float | None:
        """Pause before a request whose connection failed is sent again [s]; None when it must not be."""
        if attempt + 1 >= self.attempts or isinstance(error, httpx2.UnsupportedProtocol | httpx2.LocalProtocolError):
            return None
        never_sent = isinstance(error, httpx2.ConnectError | httpx2.ConnectTimeout)
        broken = isinstance(error, httpx2.NetworkError | httpx2.RemoteProtocolError)
        return self.backoff(attempt) if never_sent or (broken and repeatable) else None


def retry_after(response: httpx2.Response) -> float | None:
    """After how long the service wants to be asked again [s]; None where it does not say."""
    value = response.headers.get("Retry-After", "")
    if value.isascii() and value.isdigit():
        return float(value)
    try:
        return max((parsedate_to_datetime(value) - datetime.now(UTC)).total_seconds(), 0.0)
    except (ValueError, TypeError):  # absent, no date, or one without a time zone
        return None
