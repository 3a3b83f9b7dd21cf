"""API keys: shown once when they are created, kept as hashes."""

import hashlib
import hmac
import secrets
import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import sqlalchemy as sa

from fingersplit_service.database.store import Store, accepting, reading
from fingersplit_service.database.tables import api_keys

__all__ = ["LOCAL_OWNER", "SCOPES", "KeyRow", "KeyStore", "Scope", "matches", "split_key"]

Scope = Literal["read", "plan", "admin"]
"""What a key may do: look at its own things, make and delete them, look at the whole service's metrics."""
SCOPES: tuple[Scope, ...] = get_args(Scope)

LOCAL_OWNER = "local"
"""Whose everything is that is made while a service has no keys."""
_PREFIX = "fsk"


@dataclass(frozen=True)
class KeyRow:
    """A key as the table has it."""

    id: str
    name: str
    hash: str
    scopes: tuple[Scope, ...]
    created_at: float
    revoked_at: float | None


class KeyStore(Store):
    """The keys of a service, revoked ones included."""

    @accepting
    def create(self, connection: sa.Connection, name: str, scopes: Iterable[Scope]) -> str:
        """Make a key; what is returned is shown nowhere again."""
        key_id, secret = secrets.token_hex(6), secrets.token_urlsafe(32)
        row = {
            "id": key_id,
            "name": name,
            "hash": _hash(secret),
            "scopes": " ".join(scopes),
            "created_at": time.time(),
        }
        connection.execute(sa.insert(api_keys).values(row))
        return f"{_PREFIX}_{key_id}_{secret}"

    @reading
    def all(self, connection: sa.Connection) -> list[KeyRow]:
        """Every key, oldest first."""
        rows = connection.execute(sa.select(api_keys).order_by(api_keys.c.created_at)).mappings()
        return [KeyRow(**(dict(row) | {"scopes": tuple(row["scopes"].split())})) for row in rows]

    @accepting
    def revoke(self, connection: sa.Connection, key_id: str) -> bool:
        """End a key; False when there is none of that id that is not revoked."""
        which = (api_keys.c.id == key_id) & api_keys.c.revoked_at.is_(None)
        return connection.execute(sa.update(api_keys).where(which).values(revoked_at=time.time())).rowcount == 1


def split_key(key: str) -> tuple[str, str] | None:
    """Id and secret of a key as it was shown; None for what is no key."""
    prefix, _, rest = key.partition("_")
    key_id, _, secret = rest.partition("_")
    return (key_id, secret) if prefix == _PREFIX and key_id and secret else None


def matches(row: KeyRow, secret: str) -> bool:
    """Whether a secret is that of a key, compared in constant time."""
    return hmac.compare_digest(row.hash, _hash(secret))


def _hash(secret: str) -> str:
    # Nothing slower is needed: 256 random bits cannot be guessed, however fast guesses are.
    return hashlib.sha256(secret.encode("utf-8", "surrogatepass")).hexdigest()
