"""Authentication of requests, and the permissions of their keys."""

import time
from dataclasses import dataclass
from typing import Annotated

from fastapi import Request, Security
from fastapi.security import APIKeyCookie, HTTPBearer, SecurityScopes
from fastapi.security.http import HTTPAuthorizationCredentials

from fingersplit_service.database.keys import LOCAL_OWNER, SCOPES, KeyRow, KeyStore, Scope, matches, split_key
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.security.sessions import SESSION_COOKIE, Sessions

__all__ = ["KEY_NEEDED", "Access", "Admin", "Planner", "Principal", "Reader", "identify"]

_FRESH = 1.0  # how long a look at the keys is good for: a revoked one ends within this time [s]


@dataclass(frozen=True)
class Principal:
    """Whoever asks: everything they make belongs to ``owner``."""

    owner: str
    name: str
    scopes: tuple[Scope, ...]


KEY_NEEDED = "Send `Authorization: Bearer KEY` with a valid API key."
"""What a client without a key is told."""
_LOCAL = Principal(LOCAL_OWNER, "local", SCOPES)
"""Everybody, as long as the service has no keys."""


class Access:
    """The keys as they are now.

    Args:
        keys: Where they are kept.
    """

    def __init__(self, keys: KeyStore) -> None:
        self.sessions = Sessions()
        self._keys = keys
        self._known: dict[str, KeyRow] = {}
        self._fresh_until = 0.0

    async def open(self) -> bool:
        """Whether no key was ever made, so that everybody who can reach the service may use it."""
        return not await self._rows()

    async def of_key(self, key: str) -> Principal | None:
        """Whose key it is; None for what is no key, or a revoked one."""
        parts = split_key(key)
        row = (await self._rows()).get(parts[0]) if parts else None
        if parts is None or row is None or row.revoked_at is not None or not matches(row, parts[1]):
            return None
        return Principal(row.id, row.name, row.scopes)

    async def of_session(self, token: str) -> Principal | None:
        """Whose session it is; it ends with its key."""
        row = (await self._rows()).get(self.sessions.key_of(token) or "")
        return None if row is None or row.revoked_at is not None else Principal(row.id, row.name, row.scopes)

    async def identify(self, key: str | None, token: str | None) -> Principal | None:
        """The principal of a request with a key or a session; None without either."""
        if await self.open():
            return _LOCAL
        if key is not None:
            return await self.of_key(key)
        return None if token is None else await self.of_session(token)

    async def _rows(self) -> dict[str, KeyRow]:
        if time.monotonic() >= self._fresh_until:
            self._known = {row.id: row for row in await self._keys.all()}
            self._fresh_until = time.monotonic() + _FRESH
        return self._known


async def identify(request: Request) -> Principal | None:
    """Who sends a request, by its key or its session; None for an anonymous client."""
    scheme, _, key = request.headers.get("authorization", "").partition(" ")
    access: Access = request.app.state.runtime.access
    return await access.identify(key if scheme.lower() == "bearer" else None, request.cookies.get(SESSION_COOKIE))


async def _principal(
    request: Request,
    scopes: SecurityScopes,
    _bearer: Annotated[
        HTTPAuthorizationCredentials | None,
        Security(HTTPBearer(auto_error=False, scheme_name="key", description="An API key.")),
    ],
    _session: Annotated[
        str | None,
        Security(APIKeyCookie(name=SESSION_COOKIE, auto_error=False, scheme_name="session", description="For pages.")),
    ],
) -> Principal:
    principal = await identify(request)
    if principal is None:
        raise ProblemError(ProblemKind.UNAUTHENTICATED, KEY_NEEDED)
    missing = [scope for scope in scopes.scopes if scope not in principal.scopes]
    if missing:
        detail = f"This needs a key with the scope {missing[0]!r}; yours has {', '.join(principal.scopes) or 'none'}."
        raise ProblemError(ProblemKind.FORBIDDEN, detail)
    return principal


Reader = Annotated[Principal, Security(_principal, scopes=["read"])]
"""Somebody who may look at their own things, as a parameter of an endpoint."""
Planner = Annotated[Principal, Security(_principal, scopes=["plan"])]
"""Somebody who may make and delete their own things."""
Admin = Annotated[Principal, Security(_principal, scopes=["admin"])]
"""Somebody who may look at the whole service."""
