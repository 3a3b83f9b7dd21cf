"""Small pictures of a grasp on a transparent ground, still or moving, as WebP; no display and no OpenGL."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from fingersplit.objects.mesh import Mesh
from fingersplit.recording.raycast import Camera, Layer, render
from fingersplit.recording.scene import GraspView, PosableHand, grasp_camera, grasp_layers

__all__ = ["draw_moving_picture", "draw_thumbnail"]

THUMBNAIL_SIZE = (192, 144)
"""[pixels]"""
MOVING_SIZE = (480, 360)
"""[pixels]"""
FRAMES = 14
FRAME_TIME, LAST_FRAME_TIME = 110, 1500
"""[ms]"""
QUALITY = 82


def draw_thumbnail(path: Path, mesh: Mesh, hand: PosableHand, grasp: GraspView) -> None:
    """Write a WebP of one grasp.

    Args:
        path: File to write.
        mesh: The object.
        hand: The hand.
        grasp: What is shown.
    """
    layers = grasp_layers(mesh, hand, grasp)
    camera = _framed(grasp_camera([layers, layers], (grasp, grasp)), [layers], THUMBNAIL_SIZE)
    _image(layers, camera).save(path, format="WEBP", quality=QUALITY)


def draw_moving_picture(path: Path, mesh: Mesh, hand: PosableHand, states: Sequence[GraspView]) -> None:
    """Write an animated WebP that goes from the first state to the last and stays there for a moment.

    Args:
        path: File to write.
        mesh: The object.
        hand: The hand.
        states: The states in order; evenly spaced ones are drawn.
    """
    rows = np.unique(np.linspace(0, len(states) - 1, FRAMES).round().astype(int))
    scenes = [grasp_layers(mesh, hand, states[row]) for row in rows]
    ends = [scenes[0], scenes[-1]]
    camera = _framed(grasp_camera(ends, (states[0], states[-1])), ends, MOVING_SIZE)
    images = [_image(layers, camera) for layers in scenes]
    images[0].save(
        path,
        format="WEBP",
        quality=QUALITY,
        save_all=True,
        append_images=images[1:],
        duration=[FRAME_TIME] * (len(images) - 1) + [LAST_FRAME_TIME],
        loop=0,
    )


def _framed(camera: Camera, scenes: Sequence[list[Layer]], size: tuple[int, int]) -> Camera:
    """The same direction, as close as a picture of this size allows."""
    points = np.vstack([layer.vertices for layers in scenes for layer in layers])
    return Camera.framing(points, camera.axes[2], camera.up, size=size, margin=0.02)


def _image(layers: list[Layer], camera: Camera) -> Image.Image:
    return Image.fromarray((255 * render(layers, camera)).round().astype(np.uint8), "RGBA")
