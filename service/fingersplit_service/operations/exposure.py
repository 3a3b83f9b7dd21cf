"""A service that others can reach needs keys."""

from fingersplit_service.database.keys import KeyStore
from fingersplit_service.settings import ServiceSettings, is_loopback

__all__ = ["Exposed", "refuse_exposure"]


class Exposed(Exception):  # noqa: N818
    """The service would listen where strangers can reach it, and let them in."""


async def refuse_exposure(settings: ServiceSettings, keys: KeyStore) -> None:
    """Refuse to listen beyond loopback as long as there is no key.

    Raises:
        Exposed: There is none.
    """
    if is_loopback(settings.host) or settings.allow_unauthenticated:
        return
    if not any(row.revoked_at is None for row in await keys.all()):
        raise Exposed(
            f"Refusing to listen on {settings.host}: without API keys anyone who reaches it could use the service. "
            "Make one with `fingersplit keys create NAME`, listen on 127.0.0.1, or set "
            "FINGERSPLIT_ALLOW_UNAUTHENTICATED=true where the network itself keeps strangers out."
        )
