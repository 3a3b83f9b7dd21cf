"""A recording as a file: opened, written, closed, nothing of it left in the process; and how it opens in the viewer."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.metrics import available_metrics
from fingersplit.extras import extra
from fingersplit.objects.model import ObjectModel
from fingersplit.recording.replay import ReplayedGrasp
from fingersplit.recording.series import RecordedFrames

with extra("recording"):
    import rerun as rr
    import rerun.blueprint as rrb
    import rerun_bindings

__all__ = ["APPLICATION", "Eye", "Layout", "choose_view", "grasp_blueprint", "recording_file"]

APPLICATION = "fingersplit"


class Layout(rrb.Blueprint):
    """A blueprint that can be let go of.

    rerun keeps the threads of a recording until it is told to look for orphans, and a blueprint that was handed over
    never becomes one: its memory and its stream hold each other (rerun-sdk 0.41). Each recording would leave four
    threads and 5 MB behind, and a worker that writes many would die of it.
    """

    def __init__(self, *parts: Any, **options: Any) -> None:
        super().__init__(*parts, **options)
        self._streams = list[rr.RecordingStream]()

    def _log_to_stream(self, stream: rr.RecordingStream) -> None:
        self._streams.append(stream)
        super()._log_to_stream(stream)

    def let_go(self) -> None:
        """Close what it was written to; its memory is free once orphans are looked for."""
        while self._streams:
            self._streams.pop().disconnect()


@contextmanager
def recording_file(path: Path, layout: Layout) -> Iterator[rr.RecordingStream]:
    """A recording that is written to a file; complete when the context ends.

    Args:
        path: The .rrd file to write.
        layout: How it opens.
    """
    rerun_bindings.flush_and_cleanup_orphaned_recordings()  # those before; this one is held by whoever writes it
    # Every message is its own chunk: rerun compresses one in the background while the next is made.
    stream = rr.RecordingStream(APPLICATION, batcher_config=rr.ChunkBatcherConfig(flush_num_rows=1))
    stream.save(path, default_blueprint=layout)
    layout.let_go()
    try:
        yield stream
        stream.flush()
    finally:
        stream.disconnect()


Eye = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Where the scene is seen from, and the point looked at, (3,) each [m]."""

BACKGROUND = (34, 40, 49)
HAND_REACH = 0.2
"""About how far a hand stands out of the object it grasps [m]."""


def grasp_blueprint(eye: Eye, *, simulated: bool) -> Layout:
    """The layout of a run's recording.

    Args:
        eye: Where the scene is seen from.
        simulated: Whether the recording goes on through a simulation.
    """
    position, target = eye
    scene = rrb.Spatial3DView(
        origin="world",
        name="Grasp",
        background=BACKGROUND,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(position=position, look_target=target, eye_up=(0.0, 0.0, 1.0)),
    )
    recorded = [metric for metric in available_metrics().values() if metric.recorded_states != 0]
    curves = [
        _curve(", ".join(metric.title for metric in recorded), "metrics"),
        _curve("Gaps and penetration [mm]", "constraints/gap_mm"),
        _curve("Pad tilt [rad]", "constraints/pad_angle_rad"),
        _curve("Parts of Q", "quality_parts"),
    ]
    simulation = [
        _curve("Contact forces [N]", "simulation/force_N"),
        _curve("Slip in the hand [mm]", "simulation/slip_mm"),
        _curve("Turn in the hand [deg]", "simulation/turn_deg"),
    ]
    return Layout(
        rrb.Horizontal(
            scene,
            rrb.Vertical(
                _curve("Quality Q", "quality"),
                rrb.StateTimelineView(origin="phase", name="Phase"),
                rrb.Tabs(*curves, name="Metrics"),
                *([rrb.Tabs(*simulation, name="Simulation")] if simulated else []),
                rrb.Tabs(
                    rrb.TextLogView(origin="log", name="Log"),
                    rrb.TextDocumentView(origin="summary", name="Summary"),
                ),
                row_shares=[3, 2.6, 2.8, *([2.8] if simulated else []), 2.6],
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


def choose_view(
    model: ObjectModel, replayed: ReplayedGrasp, simulations: list[RecordedFrames], *, side_by_side: bool
) -> tuple[Eye, NDArray[np.float64]]:
    """An eye that sees the fingers from the side, and where a second scene stands beside the first.

    Args:
        model: The object.
        replayed: The grasp with its history.
        simulations: What follows the planning.
        side_by_side: Whether there is a second scene.

    Returns:
        The eye, and the offset of the second scene, (3,) [m].
    """
    up = np.array([0.0, 0.0, 1.0])
    palm_x = replayed.trace.palm_rotations[-1][:, 0]  # across the closing direction of the fingers
    towards = palm_x - (palm_x @ up) * up
    if np.linalg.norm(towards) < 0.3:
        towards = np.cross(replayed.trace.palm_rotations[-1][:, 2], up)
    towards = towards / np.linalg.norm(towards)
    right = np.cross(up, towards)
    radius = model.radius + HAND_REACH
    beside = 1.2 * radius * right
    raised = max((float(np.ptp(one.object_poses.positions[0, :, 2])) for one in simulations), default=0.0)
    middle = (replayed.trace.palm_positions[-1] + model.center_of_mass) / 2
    target = middle + raised / 2 * up + (beside / 2 if side_by_side else 0)
    distance = 1.15 * radius + 0.8 * raised + (0.35 * radius if side_by_side else 0)
    direction = towards + 0.35 * up + 0.35 * right
    return (target + distance * direction / np.linalg.norm(direction), target), beside
