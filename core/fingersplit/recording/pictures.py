"""Pictures of grasps as PNG and WebP: no display and no OpenGL."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import numpy as np

from fingersplit.extras import extra
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.recording import colors
from fingersplit.recording.raycast import Camera, Layer, render
from fingersplit.recording.replay import QualityCurve, ReplayedGrasp
from fingersplit.recording.scene import GraspView, grasp_camera, grasp_layers

with extra("pictures"):
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch
    from PIL import Image

__all__ = ["draw_animation", "draw_picture", "draw_thumbnail", "shade_phases"]

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
    figure = Figure(figsize=(15, 5.4), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    start, end, profile = figure.subplots(1, 3, width_ratios=(1, 1, 1.05))
    for axes, layers, heading in ((start, scenes[0], "start"), (end, scenes[1], "end")):
        axes.imshow(render(layers, camera))
        axes.set_title(heading)
        axes.set_axis_off()
    _draw_curve(profile, replayed.curve)
    figure.suptitle(f"{model.name}, {hand.name} hand, {replayed.grasp.title}", fontweight="bold")
    figure.savefig(path, format="png", facecolor="white")


def draw_thumbnail(path: Path, grasp: Grasp, model: ObjectModel, hand: Hand) -> None:
    """Write a small WebP of one grasp on a transparent ground."""
    view = GraspView(grasp.object_from_palm, grasp.joints, grasp.contacts, grasp.normals)
    layers = grasp_layers(model.mesh, hand, view)
    camera = _framed(grasp_camera([layers, layers], (view, view)), [layers], THUMBNAIL_SIZE)
    _image(layers, camera).save(path, format="WEBP", quality=QUALITY)


def draw_animation(path: Path, replayed: ReplayedGrasp, model: ObjectModel, hand: Hand) -> None:
    """Write an animated WebP from the mapped start to the grasp, where it stays for a moment; evenly spaced states."""
    rows = np.unique(np.linspace(0, len(replayed.trace) - 1, FRAMES).round().astype(int)).tolist()
    states = [_state(replayed, row) for row in rows]
    scenes = [grasp_layers(model.mesh, hand, state) for state in states]
    ends = [scenes[0], scenes[-1]]
    camera = _framed(grasp_camera(ends, (states[0], states[-1])), ends, ANIMATION_SIZE)
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
