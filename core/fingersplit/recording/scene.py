"""A grasp as something to look at: object, hand, contacts and the camera that sees most of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.extras import extra
from fingersplit.objects.mesh import Mesh
from fingersplit.recording import colors
from fingersplit.recording.raycast import Camera, Layer, unobstructed
from fingersplit.transforms import transform_points

with extra("pictures"):
    from matplotlib.colors import to_rgb

__all__ = ["GraspView", "PosableHand", "grasp_camera", "grasp_layers"]

OBJECT_RGBA = (0.36, 0.55, 0.78, 0.45)
PALM_GREY, LINK_GREYS = 0.28, (0.66, 0.52, 0.6)
CONTACT_RADIUS = 3.5e-3
"""[m]"""
ARROW = 0.03
"""Length of the arrows along the contact normals [m]."""


class PosableHand(Protocol):
    """A hand that can be drawn."""

    def posed_meshes(self, joints: NDArray[np.float64]) -> list[tuple[str, NDArray[np.float64], NDArray[np.int64]]]:
        """Names, vertices in the palm frame (n, 3) [m] and faces (m, 3) of all parts at ``joints`` (N,) [rad]."""


@dataclass(frozen=True, eq=False)
class GraspView:
    """A grasp to look at: palm pose (4, 4), joints (N,) [rad], contacts (F, 3) [m] and their outward normals (F, 3)."""

    object_from_palm: NDArray[np.float64]
    joints: NDArray[np.float64]
    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]


def grasp_layers(mesh: Mesh, hand: PosableHand, state: GraspView) -> list[Layer]:
    """Object, hand, contact balls and arrows along the inward normals, in the object frame."""
    layers = [Layer(mesh.vertices, mesh.faces, OBJECT_RGBA)]
    for part, (name, vertices, faces) in enumerate(hand.posed_meshes(state.joints)):
        grey = LINK_GREYS[part % len(LINK_GREYS)] if name.startswith("finger") else PALM_GREY
        layers.append(Layer(transform_points(state.object_from_palm, vertices), faces, (grey, grey, grey, 1.0)))
    for f, (contact, normal) in enumerate(zip(state.contacts, state.normals, strict=True)):
        rgba = (*to_rgb(colors.FINGERS[f % len(colors.FINGERS)]), 1.0)
        ball = trimesh.creation.icosphere(subdivisions=2, radius=CONTACT_RADIUS)
        layers.append(Layer(ball.vertices + contact, ball.faces, rgba))
        shaft_end, tip = contact - 0.7 * ARROW * normal, contact - ARROW * normal
        shaft = trimesh.creation.cylinder(radius=0.35 * CONTACT_RADIUS, segment=[contact, shaft_end], sections=16)
        layers.append(Layer(shaft.vertices, shaft.faces, rgba))
        head = trimesh.creation.cone(radius=CONTACT_RADIUS, height=0.3 * ARROW, sections=16)
        head.apply_transform(trimesh.geometry.align_vectors([0, 0, 1], tip - shaft_end))
        layers.append(Layer(head.vertices + shaft_end, head.faces, rgba))
    return layers


def grasp_camera(scenes: Sequence[list[Layer]], states: tuple[GraspView, GraspView]) -> Camera:
    """The view of the final grasp in which the hand hides least of contacts and object, palm up or down."""
    final, hand_parts = states[1], [layer for layer in scenes[1] if len(set(layer.rgba[:3])) == 1]
    approach = final.object_from_palm[:3, 2]
    body = scenes[1][0].vertices
    targets = np.vstack([np.repeat(final.contacts, 20, axis=0), body[:: max(1, len(body) // 200)]])
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    around = np.column_stack([np.cos(turns), np.sin(turns)]) @ final.object_from_palm[:3, :2].T
    views = np.vstack([around - height * approach for height in (0.2, 0.6)])
    views /= np.linalg.norm(views, axis=1, keepdims=True)
    starts = (targets + 0.02 * views[:, None]).reshape(-1, 3)
    clear = unobstructed(hand_parts, starts, np.repeat(views, len(targets), axis=0)).reshape(len(views), -1)
    best_view = views[clear.sum(axis=1).argmax()]
    points = np.vstack([layer.vertices for layers in scenes for layer in layers])
    return Camera.framing(points, best_view, -approach, size=(540, 500))
