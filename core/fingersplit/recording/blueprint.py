"""How a recording opens: the scene on the left, curves, phases and the log on the right, nothing else in the way."""

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray

__all__ = ["Eye", "grasp_blueprint"]

Eye = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Where the scene is seen from, and the point looked at, (3,) each [m]."""

BACKGROUND = (34, 40, 49)


def grasp_blueprint(eye: Eye, *, lifted: bool) -> rrb.Blueprint:
    """The layout of a run's recording.

    Args:
        eye: Where the scene is seen from.
        lifted: Whether the recording goes on through a lift.
    """
    position, target = eye
    scene = rrb.Spatial3DView(
        origin="world",
        name="Grasp",
        background=BACKGROUND,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(position=position, look_target=target, eye_up=(0.0, 0.0, 1.0)),
    )
    curves = [
        _curve("Ferrari-Canny, isotropy, volume", "metrics"),
        _curve("Gaps and penetration [mm]", "constraints/gap_mm"),
        _curve("Pad tilt [rad]", "constraints/pad_angle_rad"),
        _curve("Parts of Q", "quality_parts"),
    ]
    lift = [
        _curve("Contact forces [N]", "lift/force_N"),
        _curve("Slip in the hand [mm]", "lift/slip_mm"),
        _curve("Turn in the hand [deg]", "lift/turn_deg"),
    ]
    return rrb.Blueprint(
        rrb.Horizontal(
            scene,
            rrb.Vertical(
                _curve("Quality Q", "quality"),
                rrb.StateTimelineView(origin="phase", name="Phase"),
                rrb.Tabs(*curves, name="Metrics"),
                *([rrb.Tabs(*lift, name="Lift")] if lifted else []),
                rrb.Tabs(
                    rrb.TextLogView(origin="log", name="What happened"),
                    rrb.TextDocumentView(origin="summary", name="Summary"),
                ),
                row_shares=[3, 2, 3, *([3] if lifted else []), 2.6],
            ),
            column_shares=[5, 4],
        ),
        rrb.TimePanel(state="collapsed", timeline="step", fps=24.0, play_state="playing", loop_mode="all"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _curve(name: str, origin: str) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(origin=origin, name=name)
