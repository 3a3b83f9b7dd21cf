"""One grasp on one sheet: hand and object at the start and at the end, beside the quality curve."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from fingersplit.objects.mesh import Mesh
from fingersplit.recording.raycast import render
from fingersplit.recording.scene import GraspView, PosableHand, grasp_camera, grasp_layers

__all__ = ["QualityCurve", "draw_grasp", "shade_phases"]

PHASE_COLORS = {"cpo": "#f6d55c", "ppo": "#8fb8de"}
"""Yellow and blue, as in the quality profile of [Fan2018]."""


@dataclass(frozen=True, eq=False)
class QualityCurve:
    """Q of every state (T,), the phase that led to it, and the largest distance of a pad from its contact (T,) [m]."""

    quality: NDArray[np.float64]
    phases: Sequence[str]
    residual: NDArray[np.float64]


def draw_grasp(
    path: Path,
    *,
    mesh: Mesh,
    hand: PosableHand,
    states: tuple[GraspView, GraspView],
    curve: QualityCurve,
    title: str,
) -> None:
    """Write a PNG of a grasp's start, its end and its quality curve.

    Args:
        path: File to write.
        mesh: The object.
        hand: The hand.
        states: The mapped start and the final grasp.
        curve: What happened in between.
        title: Heading of the sheet.
    """
    scenes = [grasp_layers(mesh, hand, state) for state in states]
    camera = grasp_camera(scenes, states)
    figure = Figure(figsize=(15, 5.4), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    start, end, profile = figure.subplots(1, 3, width_ratios=(1, 1, 1.05))
    for axes, layers, heading in ((start, scenes[0], "start"), (end, scenes[1], "end")):
        axes.imshow(render(layers, camera))
        axes.set_title(heading)
        axes.set_axis_off()
    _draw_curve(profile, curve)
    figure.suptitle(title, fontweight="bold")
    figure.savefig(path, format="png", facecolor="white")


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


def shade_phases(axes: Axes, phases: Sequence[str]) -> list[Patch]:
    """Shade the states of CPO and of PPO, one state a unit along x, and return the entries for a legend."""
    row = 0
    for phase, group in groupby(phases):
        count = len(list(group))
        if phase in PHASE_COLORS:
            axes.axvspan(row - 0.5, row + count - 0.5, color=PHASE_COLORS[phase], alpha=0.45, lw=0)
        row += count
    return [Patch(color=color, alpha=0.45, label=phase.upper()) for phase, color in PHASE_COLORS.items()]
