"""``mcp``: tools for assistants, over standard input and output."""

from fingersplit_client.commands.connection import ApiKey, Server, with_error_messages

__all__ = ["mcp"]


@with_error_messages
def mcp(server: Server = None, api_key: ApiKey = None) -> None:
    """Serve grasp planning as tools of the Model Context Protocol, over standard input and output.

    An assistant starts this program itself: give it the command `fingersplit mcp --server URL`.
    """
    from fingersplit_client.client import AsyncClient
    from fingersplit_client.errors import invalid

    try:
        from fingersplit_client.doors.mcp_server import build_server
    except ModuleNotFoundError as error:
        raise invalid(f"This needs the package {error.name!r}: pip install 'fingersplit-client[mcp]'.") from error
    build_server(AsyncClient(server, api_key=api_key)).run()
