"""The hands that can be planned for, and uploads of others."""

import difflib
import os
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, Generic
from zipfile import ZIP_DEFLATED, ZipFile

from pydantic import TypeAdapter

from fingersplit_client._exchange import given, parse, parse_list, quoted
from fingersplit_client._flow import Flow, Work
from fingersplit_client.errors import invalid
from fingersplit_client.mesh_files import read_file
from fingersplit_client.modes import Mode, operation
from fingersplit_client.resources.resource import Resource
from fingersplit_client.schemas import HandDetail, HandInfo

__all__ = ["Hands"]

COMPILES_WITHIN = 300.0
"""What the answer may take longer than others, where a hand is compiled, drafted or tried for it [s]."""
_HANDS = TypeAdapter(list[HandInfo])


class Hands(Resource[Mode], Generic[Mode]):
    """The hands that can be planned for: those that ship with the service, and your own."""

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

    @operation
    def details(self, name: str) -> Flow[HandDetail]:
        """A hand, shipped or uploaded, with its description and the report of its check."""
        response = yield from self._exchange("GET", _hand_path(name), longer=COMPILES_WITHIN)
        return parse(HandDetail, response)

    @operation
    def upload(
        self,
        archive: "os.PathLike[str] | str | bytes | BinaryIO",
        *,
        model: str | None = None,
        palm: str | None = None,
        fingers: str | None = None,
    ) -> Flow[HandDetail]:
        """Upload a hand; its ``name`` can then be the ``hand`` of a job. It takes a minute without a description.

        Args:
            archive: A folder, or a zip of one as its path, an open file or its bytes: the model, its meshes, and
                ``hand.toml``; without that the description is drafted.
            model: Model file in it, where there are several and no description.
            palm: Body of the palm, where a draft finds the wrong one.
            fingers: Last bodies of the fingers, separated by commas, where a draft finds others.

        Raises:
            InvalidRequestError: The archive holds no hand that can be planned with; it says why.
            OSError: The file cannot be read.
        """
        name, content = yield Work(lambda: _archive(archive))
        response = yield from self._exchange(
            "POST",
            "/v1/hands",
            data=given(model=model, palm=palm, fingers=fingers),
            files={"file": (name, content, "application/zip")},
            repeatable=True,
            longer=COMPILES_WITHIN,
        )
        return parse(HandDetail, response)

    @operation
    def correct(self, name: str, description: str) -> Flow[HandDetail]:
        """Give an uploaded hand another description, TOML; that is another hand, with a name of its own."""
        response = yield from self._exchange(
            "POST",
            f"{_hand_path(name)}/descriptions",
            json={"description": description},
            repeatable=True,
            longer=COMPILES_WITHIN,
        )
        return parse(HandDetail, response)

    @operation
    def try_out(self, name: str) -> Flow[HandDetail]:
        """Plan for a sphere, a box and a cylinder in three sizes; the outcome stands in ``trial``."""
        response = yield from self._exchange(
            "POST", f"{_hand_path(name)}/trial", repeatable=True, longer=COMPILES_WITHIN
        )
        return parse(HandDetail, response)

    @operation
    def picture(self, name: str) -> Flow[bytes]:
        """A PNG of a hand half-way and at its preshapes."""
        response = yield from self._exchange("GET", f"{_hand_path(name)}/picture.png", longer=COMPILES_WITHIN)
        return bytes(response.content)

    @operation
    def delete(self, name: str) -> Flow[None]:
        """Delete an uploaded hand; ended jobs keep their results."""
        yield from self._exchange("DELETE", _hand_path(name))


def _hand_path(name: str) -> str:
    """Address of a hand."""
    return f"/v1/hands/{quoted(name)}"


def _archive(source: "os.PathLike[str] | str | bytes | BinaryIO") -> tuple[str, bytes]:
    """Name and content of a zip; a folder is packed."""
    folder = Path(source) if isinstance(source, str | os.PathLike) else None
    if folder is None or not folder.is_dir():
        file = read_file(source, "hand")
        return file.filename if file.suffix else f"{file.stem}.zip", file.content
    content = BytesIO()
    with ZipFile(content, "w", ZIP_DEFLATED) as target:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                target.write(path, path.relative_to(folder).as_posix())
    return f"{folder.resolve().name}.zip", content.getvalue()
