"""Pictures of grasps as PNG and WebP: no display and no OpenGL."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.extras import extra
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.recording import colors
from fingersplit.recording.looks import posed_looks
from fingersplit.recording.raycast import Camera, Layer, render, unobstructed
from fingersplit.recording.replay import QualityCurve, ReplayedGrasp
from fingersplit.recording.surroundings import find_surroundings, path_of
from fingersplit.transforms import transform_points

with extra("pictures"):
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import to_rgb
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch
    from PIL import Image

__all__ = [
    "GraspView",
    "draw_animation",
    "draw_picture",
    "draw_thumbnail",
    "grasp_camera",
    "grasp_layers",
    "shade_phases",
    "surrounding_layers",
    "way_layers",
]

CONTACT_RADIUS = 3.5e-3
"""[m]"""
ARROW = 0.03
"""Length of the arrows along the contact normals [m]."""
WAY_RADIUS = 1.5e-3
"""Of the palm's way in and out [m]."""
CLOUD_BALLS, CLOUD_RADIUS = 1_500, 2e-3
"""How many points of a cloud are drawn at most, and how large [m]."""
_AROUND = {
    "support": colors.SUPPORT,
    "obstacle": colors.OBSTACLE,
    "cloud": colors.OBSTACLE,
    "forbidden": colors.FORBIDDEN,
}


@dataclass(frozen=True, eq=False)
class GraspView:
    """A grasp to look at: palm pose (4, 4), joints (N,) [rad], contacts (F, 3) [m] and their outward normals (F, 3)."""

    object_from_palm: NDArray[np.float64]
    joints: NDArray[np.float64]
    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]


def grasp_layers(mesh: Mesh, hand: Hand, state: GraspView) -> list[Layer]:
    """Object, hand, contact balls and arrows along the inward normals, in the object frame."""
    layers = [Layer(mesh.vertices, mesh.faces, colors.fractions(colors.OBJECT))]
    for look, vertices in posed_looks(hand, state.joints):
        placed = transform_points(state.object_from_palm, vertices)
        layers.append(Layer(placed, look.faces, (*look.rgb, 1.0), part="hand"))
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


def surrounding_layers(replayed: ReplayedGrasp, model: ObjectModel) -> list[Layer]:
    """Supports, obstacles, clouds as small balls, and surface that must not be touched, in the object frame."""
    layers = []
    for one in find_surroundings(replayed.scene, model, replayed.rejected_by):
        color = colors.fractions(_AROUND[one.kind])
        if one.kind == "cloud":
            layers.append(_balls(one.vertices, color))
        else:
            layers.append(Layer(one.vertices, one.faces, color))
    return layers


def way_layers(replayed: ReplayedGrasp) -> list[Layer]:
    """The way of the palm's origin in and out, as thin rods, where the grasp has one."""
    path, rgba = path_of(replayed.grasp), colors.fractions(colors.WAY)
    rods = []
    for start, end in pairwise(path):
        if np.linalg.norm(end - start) > WAY_RADIUS:
            rod = trimesh.creation.cylinder(radius=WAY_RADIUS, segment=[start, end], sections=16)
            rods.append(Layer(rod.vertices, rod.faces, rgba))
    return rods


def _balls(points: NDArray[np.float64], rgba: tuple[float, float, float, float]) -> Layer:
    """A small ball at some of the points."""
    shown = points[:: max(1, len(points) // CLOUD_BALLS)]
    ball = trimesh.creation.icosphere(subdivisions=0, radius=CLOUD_RADIUS)
    vertices = (shown[:, None] + ball.vertices).reshape(-1, 3)
    steps = len(ball.vertices) * np.arange(len(shown))
    return Layer(vertices, (steps[:, None, None] + ball.faces).reshape(-1, 3), (*rgba[:3], 1.0))


def grasp_camera(scenes: Sequence[list[Layer]], states: tuple[GraspView, GraspView]) -> Camera:
    """The view of the final grasp in which the hand hides least of contacts and object, palm up or down."""
    final, hand_parts = states[1], [layer for layer in scenes[1] if layer.part == "hand"]
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


THUMBNAIL_SIZE = (192, 144)
"""[pixels]"""
ANIMATION_SIZE = (480, 360)
"""[pixels]"""
FRAMES = 14
FRAME_TIME, LAST_FRAME_TIME = 110, 1500
"""[ms]"""
QUALITY = 82
"""Of the WebP compression, 0 to 100."""
SHADED_PHASES = ("cpo", "ppo")


def draw_picture(path: Path, replayed: ReplayedGrasp, model: ObjectModel, hand: Hand) -> None:
    """Write a PNG of a grasp's start, its end and its quality curve in between."""
    states = _state(replayed, 0), _state(replayed, -1)
    scenes = [grasp_layers(model.mesh, hand, state) for state in states]
    camera = grasp_camera(scenes, states)
    around, way = surrounding_layers(replayed, model), way_layers(replayed)
    figure = Figure(figsize=(15, 5.4), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    start, end, profile = figure.subplots(1, 3, width_ratios=(1, 1, 1.05))
    for axes, layers, heading in ((start, scenes[0] + around, "start"), (end, scenes[1] + around + way, "end")):
        axes.imshow(render(layers, camera))
        axes.set_title(heading)
        axes.set_axis_off()
    _draw_curve(profile, replayed.curve)
    figure.suptitle(f"{model.name}, {hand.name} hand, {replayed.grasp.title}", fontweight="bold")
    if replayed.rejected_by:
        counts = ", ".join(f"{name} {count}" for name, count in replayed.rejected_by.items())
        figure.supxlabel(f"candidates rejected by: {counts}", fontsize="small")
    figure.savefig(path, format="png", facecolor="white")


def draw_thumbnail(path: Path, grasp: Grasp, model: ObjectModel, hand: Hand, around: Sequence[Layer] = ()) -> None:
    """Write a small WebP of one grasp on a transparent ground, with what stands around it."""
    view = GraspView(grasp.object_from_palm, grasp.joints, grasp.contacts, grasp.normals)
    layers = grasp_layers(model.mesh, hand, view)
    camera = _framed(grasp_camera([layers, layers], (view, view)), [layers], THUMBNAIL_SIZE)
    _image([*layers, *around], camera).save(path, format="WEBP", quality=QUALITY)


def draw_animation(path: Path, replayed: ReplayedGrasp, model: ObjectModel, hand: Hand) -> None:
    """Write an animated WebP from the mapped start to the grasp, where it stays for a moment; evenly spaced states."""
    rows = np.unique(np.linspace(0, len(replayed.trace) - 1, FRAMES).round().astype(int)).tolist()
    states = [_state(replayed, row) for row in rows]
    scenes = [grasp_layers(model.mesh, hand, state) for state in states]
    ends = [scenes[0], scenes[-1]]
    camera = _framed(grasp_camera(ends, (states[0], states[-1])), ends, ANIMATION_SIZE)
    around = surrounding_layers(replayed, model)
    images = [_image(layers + around, camera) for layers in scenes]
    images[0].save(
        path,
        format="WEBP",
        quality=QUALITY,
        save_all=True,
        append_images=images[1:],
        duration=[FRAME_TIME] * (len(images) - 1) + [LAST_FRAME_TIME],
        loop=0,
    )


def shade_phases(axes: Axes, phases: Sequence[str]) -> list[Patch]:
    """Shade the states of CPO and of PPO, one state a unit along x, and return the entries for a legend."""
    row = 0
    for phase, group in groupby(phases):
        count = len(list(group))
        if phase in SHADED_PHASES:
            axes.axvspan(row - 0.5, row + count - 0.5, color=colors.PHASES[phase], alpha=0.45, lw=0)
        row += count
    return [Patch(color=colors.PHASES[phase], alpha=0.45, label=phase.upper()) for phase in SHADED_PHASES]


def _draw_curve(axes: Axes, curve: QualityCurve) -> None:
    """Q over the states with CPO and PPO shaded, the residual as a thin line on its own scale."""
    steps = np.arange(len(curve.quality))
    patches = shade_phases(axes, curve.phases)
    (quality,) = axes.plot(steps, curve.quality, color="#c1121f", lw=2, label="quality Q")
    axes.set(xlabel="accepted iteration", ylabel="quality Q", xlim=(-0.5, max(len(steps) - 0.5, 0.5)))
    axes.set_title("quality")
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 3))
    gaps = axes.twinx()
    (residual,) = gaps.plot(steps, 1e3 * curve.residual, color="#555555", lw=0.9, ls="--", label="largest gap")
    gaps.set_ylabel("largest gap between pad and surface [mm]", color="#555555")
    gaps.set_ylim(bottom=0)
    axes.legend(handles=[quality, residual, *patches], loc="lower right", framealpha=0.9)


def _state(replayed: ReplayedGrasp, row: int) -> GraspView:
    trace = replayed.trace
    return GraspView(trace.object_from_palm(row), trace.joints[row], trace.contacts[row], trace.normals[row])


def _framed(camera: Camera, scenes: Sequence[list[Layer]], size: tuple[int, int]) -> Camera:
    """The same direction, as close as a picture of this size allows."""
    points = np.vstack([layer.vertices for layers in scenes for layer in layers])
    return Camera.framing(points, camera.axes[2], camera.up, size=size, margin=0.02)


def _image(layers: list[Layer], camera: Camera) -> Image.Image:
    return Image.fromarray((255 * render(layers, camera)).round().astype(np.uint8), "RGBA")
