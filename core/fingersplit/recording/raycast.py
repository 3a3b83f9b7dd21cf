"""A small software renderer: one ray per subpixel through embree, shading in numpy, no OpenGL and no display."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from fingersplit.recording.shading import shaded_corners

__all__ = ["Camera", "Layer", "render", "unobstructed"]

SURFACES = 6  # translucent surfaces that one ray looks through
AMBIENT = 0.36
LIGHTS = (((-0.5, 0.75, 0.6), 0.52), ((0.8, 0.1, 0.5), 0.22))  # towards the light (right, up, viewer); strength
SHINE, GLOSS = 0.16, 30
SHADOW, SHADOW_GRID = 0.34, 128
SUPERSAMPLING = 2


@dataclass(frozen=True, eq=False)
class Layer:
    """Triangles of one colour.

    Attributes:
        vertices: Corner points in the scene's frame, (n_vertices, 3) [m].
        faces: Vertex indices, counter-clockwise seen from outside, (n_faces, 3).
        rgba: Red, green, blue and opacity, each 0 to 1. Below an opacity of 1 only the faces towards the
            viewer are tinted, so that what lies behind and inside stays readable.
        part: What it belongs to, such as ``"hand"``.
    """

    vertices: NDArray[np.floating]
    faces: NDArray[np.integer]
    rgba: tuple[float, float, float, float]
    part: str = ""

    @cached_property
    def triangles(self) -> NDArray[np.float32]:
        """Corner points of every face, (n_faces, 3, 3) [m]."""
        return np.asarray(self.vertices[self.faces], dtype=np.float32)

    @cached_property
    def corner_normals(self) -> NDArray[np.float32]:
        """Unit outward normals at every face's corners, smooth except across creases, (n_faces, 3, 3)."""
        corners, _, normals = shaded_corners(self.vertices, self.faces)
        return normals[corners].astype(np.float32)


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera that looks from `eye` to `target`.

    Attributes:
        eye: Position, (3,) [m].
        target: A point in the middle of the picture, (3,) [m].
        up: Direction that points upwards in the picture, (3,).
        field_of_view: Opening angle from the lower to the upper edge [rad].
        size: Width and height [pixels].
    """

    eye: NDArray[np.float64]
    target: NDArray[np.float64]
    up: NDArray[np.float64]
    field_of_view: float
    size: tuple[int, int]

    @classmethod
    def framing(
        cls,
        points: NDArray[np.float64],
        towards_eye: NDArray[np.float64],
        up: NDArray[np.float64],
        field_of_view: float = 0.4,
        size: tuple[int, int] = (640, 480),
        margin: float = 0.05,
    ) -> "Camera":
        """The closest camera that still has all points in view.

        Args:
            points: What must be seen, (n, 3) [m].
            towards_eye: Direction from the scene to the camera, (3,).
            up: As in the camera, (3,).
            field_of_view: As in the camera [rad].
            size: As in the camera [pixels].
            margin: Share of the picture kept free at each edge.
        """
        aimed = cls(np.zeros(3), -np.asarray(towards_eye, dtype=np.float64), up, field_of_view, size)
        right, upward, viewer = aimed.axes
        depth = points @ viewer
        slope = np.tan(field_of_view / 2) * (1 - 2 * margin)
        middle, distances = np.zeros(3), []
        for axis, slant in ((right, slope * size[0] / size[1]), (upward, slope)):
            # |across - c| <= slant (d - depth) for all points gives the least distance d and the centre c.
            across = points @ axis
            high, low = np.max(across + slant * depth), np.max(-across + slant * depth)
            middle += (high - low) / 2 * axis
            distances.append((high + low) / (2 * slant))
        return cls(middle + max(distances) * viewer, middle, up, field_of_view, size)

    @property
    def axes(self) -> NDArray[np.float64]:
        """Unit directions to the right, upwards and towards the viewer, (3, 3) by rows."""
        viewer = _unit(self.eye - self.target)
        right = _unit(np.cross(self.up, viewer))
        return np.stack([right, np.cross(viewer, right), viewer])

    def rays(self, supersampling: int = 1) -> NDArray[np.float32]:
        """Unit directions through the subpixels, row by row from the upper left, (n, 3)."""
        width, height = (side * supersampling for side in self.size)
        half = np.tan(self.field_of_view / 2)
        x = ((np.arange(width) + 0.5) * 2 - width) / height * half
        y = (height - (np.arange(height) + 0.5) * 2) / height * half
        right, upward, viewer = self.axes.astype(np.float32)
        across, upwards = x.astype(np.float32)[:, None], y.astype(np.float32)[:, None, None]
        rays = across * right + upwards * upward - viewer
        rays /= np.sqrt(np.einsum("ijk,ijk->ij", rays, rays))[..., None]
        return np.asarray(rays.reshape(-1, 3), dtype=np.float32)


def render(layers: list[Layer], camera: Camera, *, shadow: bool = True) -> NDArray[np.float64]:
    """Draw the layers as the camera sees them.

    Args:
        layers: What is in the scene, in one frame.
        camera: Where it is seen from.
        shadow: Whether a soft shadow falls on the (else invisible) ground below the lowest point.

    Returns:
        Red, green, blue and opacity, each 0 to 1, (height, width, 4); the background is transparent.
    """
    triangles = np.concatenate([layer.triangles for layer in layers])
    scene = EmbreeScene()
    TriangleMesh(scene, triangles)
    directions = camera.rays(SUPERSAMPLING)
    color = np.zeros((len(directions), 3), dtype=np.float32)
    passed = np.ones(len(directions), dtype=np.float32)
    _add_surfaces(layers, scene, camera, directions, color, passed)
    if shadow:
        passed *= 1 - _ground_shadow(scene, triangles.reshape(-1, 3), camera, directions)
    opacity = 1 - passed
    color /= np.maximum(opacity, 1e-6)[:, None]
    width, height = camera.size
    blocks = np.concatenate([color * opacity[:, None], opacity[:, None]], axis=1).reshape(
        height, SUPERSAMPLING, width, SUPERSAMPLING, 4
    )
    image = blocks.mean(axis=(1, 3), dtype=np.float64)
    image[..., :3] /= np.maximum(image[..., 3:], 1e-6)
    return np.asarray(np.clip(image, 0.0, 1.0))


def unobstructed(
    layers: list[Layer], points: NDArray[np.float64], directions: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the straight way from each point (n, 3) [m] in its direction (n, 3) meets no surface, (n,)."""
    scene = EmbreeScene()
    TriangleMesh(scene, np.concatenate([layer.triangles for layer in layers]))
    hits = scene.run(points.astype(np.float32), directions.astype(np.float32), output=True)
    return np.asarray(hits["geomID"] < 0)


def _add_surfaces(
    layers: list[Layer],
    scene: EmbreeScene,
    camera: Camera,
    directions: NDArray[np.float32],
    color: NDArray[np.float32],
    passed: NDArray[np.float32],
) -> None:
    """Follow each ray from surface to surface; add what it sees to `color`, take it from the light `passed`."""
    normals = np.concatenate([layer.corner_normals for layer in layers])
    rgba = np.repeat(
        np.array([layer.rgba for layer in layers], dtype=np.float32), [len(layer.faces) for layer in layers], axis=0
    )
    rays = np.arange(len(directions))
    origins = np.broadcast_to(camera.eye.astype(np.float32), directions.shape).copy()
    skip = np.float32(2e-6 * np.linalg.norm(camera.eye - camera.target) + 1e-7)
    for _ in range(SURFACES):
        hits = scene.run(origins, directions[rays], output=True)
        met = np.flatnonzero(hits["geomID"] >= 0)
        rays, faces = rays[met], hits["primID"][met]
        along = directions[rays]
        outside = np.einsum("ij,ij->i", hits["Ng"][met], along) < 0
        u, v = hits["u"][met, None], hits["v"][met, None]
        normal = _unit(normals[faces, 0] * (1 - u - v) + normals[faces, 1] * u + normals[faces, 2] * v)
        facing = np.abs(np.einsum("ij,ij->i", normal, along))
        opacity = rgba[faces, 3]
        # A tinted film looks denser at a grazing angle, which draws the outline of translucent bodies.
        opacity = np.where(opacity < 1, outside * (1 - (1 - opacity) ** (1 / np.maximum(facing, 0.2))), 1)
        shade = _lit(rgba[faces, :3], normal * np.where(outside, 1, -1)[:, None], camera)
        color[rays] += (passed[rays] * opacity)[:, None] * shade
        passed[rays] *= 1 - opacity
        origins = origins[met] + along * (hits["tfar"][met] + skip)[:, None]
        onwards = passed[rays] > 0.02
        rays, origins = rays[onwards], origins[onwards]
        if not len(rays):
            break


def _lit(rgb: NDArray[np.float32], normals: NDArray[np.float32], camera: Camera) -> NDArray[np.float32]:
    """Lambert shading under two lights that follow the camera, with a small highlight of the first."""
    brightness = np.full(len(normals), AMBIENT, dtype=np.float32)
    for direction, strength in LIGHTS:
        towards = (_unit(np.array(direction)) @ camera.axes).astype(np.float32)
        brightness += np.float32(strength) * np.maximum(normals @ towards, 0)
    halfway = _unit(_unit(np.array(LIGHTS[0][0])) + np.array([0, 0, 1])) @ camera.axes
    highlight = SHINE * np.maximum(normals @ halfway.astype(np.float32), 0) ** GLOSS
    return np.asarray(rgb * brightness[:, None] + highlight[:, None], dtype=np.float32)


def _ground_shadow(
    scene: EmbreeScene, vertices: NDArray[np.float32], camera: Camera, directions: NDArray[np.float32]
) -> NDArray[np.float32]:
    """How dark the ground is where each ray meets it: what stands above, fading with height, blurred."""
    up = _unit(np.asarray(camera.up, dtype=np.float64))
    # Any two directions in the ground plane span the shadow's grid.
    first = _unit(np.cross(up, camera.axes[2]))
    plane = np.stack([first, np.cross(up, first)], axis=1)  # (3, 2)
    flat, heights = vertices @ plane, vertices @ up
    ground, tall = heights.min(), np.ptp(heights)
    low, high = flat.min(axis=0), flat.max(axis=0)
    pad = 0.3 * (high - low).max()
    low, cell = low - pad, ((high - low).max() + 2 * pad) / SHADOW_GRID
    steps = (np.arange(SHADOW_GRID) + 0.5) * cell
    spots = np.stack(np.meshgrid(low[0] + steps, low[1] + steps, indexing="ij"), axis=-1).reshape(-1, 2)
    origins = (spots @ plane.T + up * (ground - 0.01 * tall)).astype(np.float32)
    hits = scene.run(origins, np.broadcast_to(up, origins.shape).astype(np.float32), output=True)
    above = np.where(hits["geomID"] >= 0, np.exp(-3 * hits["tfar"] / tall), 0.0).reshape(SHADOW_GRID, SHADOW_GRID)
    dark = gaussian_filter(above, 0.03 * SHADOW_GRID)
    falling = directions @ up.astype(np.float32)
    distance = (ground - camera.eye @ up) / np.where(falling < -1e-3, falling, -np.inf)
    met = camera.eye @ plane + distance[:, None] * (directions @ plane.astype(np.float32))
    shade = map_coordinates(dark, ((met - low) / cell - 0.5).T, order=1, mode="constant")
    return np.asarray(SHADOW * np.where(falling < -1e-3, shade, 0), dtype=np.float32)


def _unit(vectors: NDArray[Any]) -> NDArray[Any]:
    """The vectors at length one; zero stays zero."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)
