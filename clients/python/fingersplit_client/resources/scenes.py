"""Scenes from a depth camera."""

import os
from collections.abc import Sequence
from typing import Any, BinaryIO, Generic, Literal, TypeAlias

from fingersplit_client._exchange import given, parse
from fingersplit_client._flow import Flow, Work
from fingersplit_client.mesh_files import MeshFile, read_file
from fingersplit_client.modes import Mode, operation
from fingersplit_client.resources.resource import Resource
from fingersplit_client.schemas import ViewedScene

__all__ = ["ImageSource", "Scenes"]

ImageSource: TypeAlias = os.PathLike[str] | str | bytes | BinaryIO
"""A file's path, an open binary file, or a file's bytes."""


class Scenes(Resource[Mode], Generic[Mode]):
    """Depth images cut into objects and scenes."""

    @operation
    def from_depth(
        self,
        image: ImageSource,
        *,
        mask: ImageSource | None = None,
        intrinsics: Sequence[float] | None = None,
        depth_scale: float | None = None,
        camera_pose: Sequence[float] | None = None,
        frame: Literal["world", "camera"] = "world",
        support: bool = False,
        clearance: float = 0.002,
        complete: bool = True,
        name: str | None = None,
        mass: float | None = None,
        friction: float | None = None,
    ) -> Flow[ViewedScene]:
        """Cut a depth image into the object to grasp and the scene around it.

        Plan with ``client.plan(viewed.object, scene=viewed.scene)``.

        Args:
            image: A ``.npz`` with ``depth`` and ``intrinsics``, or with an organised cloud ``points`` (h, w, 3); or a
                ``.png`` of 16 bits in millimetres. A path, an open binary file, or the bytes of an archive.
            mask: A ``.png`` whose pixels of the object are not 0, if the archive has no ``mask``.
            intrinsics: fx, fy, cx, cy in pixels, if the file does not say.
            depth_scale: Metres of one unit of depth; by default 0.001 for whole numbers.
            camera_pose: ``world_from_camera`` as x, y, z [m] and a quaternion w, x, y, z; optical frame.
            frame: Frame of the scene and of its answers.
            support: Whether to find the plane that the object stands on.
            clearance: Of the hand from obstacles and support [m].
            complete: Whether the target's unseen side is assumed where its support is known, and may carry contacts.
            name: Of the object, for people.
            mass: Of the object [kg].
            friction: Of its surface.

        Raises:
            InvalidRequestError: The image cannot be used, or the mask shows no graspable object.
            OSError: A file cannot be read.
        """
        file: MeshFile = yield Work(lambda: read_file(image, "view"))
        suffix = file.suffix or (".png" if file.content.startswith(b"\x89PNG") else ".npz")
        files: dict[str, Any] = {"file": (file.stem + suffix, file.content, "application/octet-stream")}
        if mask is not None:
            pixels: MeshFile = yield Work(lambda: read_file(mask, "mask"))
            files["mask"] = (pixels.stem + (pixels.suffix or ".png"), pixels.content, "application/octet-stream")
        fields = given(
            intrinsics=None if intrinsics is None else _joined(intrinsics),
            depth_scale=depth_scale,
            camera_pose=None if camera_pose is None else _joined(camera_pose),
            frame=frame,
            support="true" if support else "false",
            clearance=clearance,
            complete="true" if complete else "false",
            name=name,
            mass=mass,
            friction=friction,
        )
        response = yield from self._exchange("POST", "/v1/scenes/from-depth", data=fields, files=files, repeatable=True)
        return parse(ViewedScene, response)


def _joined(numbers: Sequence[float]) -> str:
    return ",".join(repr(float(number)) for number in numbers)
