"""A picture of a hand: half-way, at its preshapes, and its collision shapes."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingersplit.extras import extra
from fingersplit.hands.hand import Hand
from fingersplit.recording.looks import posed_looks
from fingersplit.recording.raycast import Camera, Layer, render

with extra("pictures"):
    from PIL import Image

__all__ = ["draw_hand"]

TILE = (420, 420)
"""[pixels]"""
PRESHAPES = 3
"""Most that are drawn, of the first grip."""
SHAPE_RGB = (0.93, 0.6, 0.25)


def draw_hand(path: Path, hand: Hand) -> None:
    """Write a PNG: the hand with all drivers half-way, at preshapes of its first grip, and by its collision shapes."""
    coupling = hand.model.coupling
    half = hand.model.joints_from_drivers((coupling.lower + coupling.upper) / 2)
    chosen = hand.gripper.preshapes[:PRESHAPES]
    scenes = [_layers(hand, joints) for joints in (half, *chosen)]
    shapes = [Layer(vertices, faces, (*SHAPE_RGB, 1.0)) for _, vertices, faces in hand.posed_meshes(chosen[0])]
    tiles = [_tile(layers, hand) for layers in (*scenes, shapes)]
    Image.fromarray(np.hstack(tiles)).save(path, format="PNG")


def _layers(hand: Hand, joints: NDArray[np.float64]) -> list[Layer]:
    return [Layer(vertices, look.faces, (*look.rgb, 1.0)) for look, vertices in posed_looks(hand, joints)]


def _tile(layers: list[Layer], hand: Hand) -> NDArray[np.uint8]:
    """A square on white, seen aslant from the side of the jaws, the approach upwards."""
    lateral, jaw, approach = hand.gripper.palm_from_gripper.T
    points = np.vstack([layer.vertices for layer in layers])
    camera = Camera.framing(points, lateral + 0.5 * jaw + 0.35 * approach, approach, size=TILE)
    image = render(layers, camera)
    white = image[..., :3] * image[..., 3:] + 1 - image[..., 3:]
    return np.asarray((255 * white).round(), dtype=np.uint8)
