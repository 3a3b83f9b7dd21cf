"""The hands that can be planned for."""

import difflib
from typing import Generic

from pydantic import TypeAdapter

from fingersplit_client._exchange import parse_list
from fingersplit_client._flow import Flow
from fingersplit_client.errors import invalid
from fingersplit_client.modes import Mode, operation
from fingersplit_client.resources.resource import Resource
from fingersplit_client.schemas import HandInfo

__all__ = ["Hands"]

_HANDS = TypeAdapter(list[HandInfo])


class Hands(Resource[Mode], Generic[Mode]):
    """The hands that can be planned for."""

    @operation
    def list(self) -> Flow[list[HandInfo]]:
        """Every hand with its fingers, joints and limits."""
        response = yield from self._exchange("GET", "/v1/hands")
        return parse_list(_HANDS, response)

    @operation
    def get(self, name: str) -> Flow[HandInfo]:
        """One hand.

        Raises:
            InvalidRequestError: There is none of this name.
        """
        hands = {hand.name: hand for hand in (yield from Hands.list.flow(self))}
        if name not in hands:
            close = difflib.get_close_matches(name, hands, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"known hands: {', '.join(hands)}."
            raise invalid(f"There is no hand {name!r}; {hint}")
        return hands[name]
