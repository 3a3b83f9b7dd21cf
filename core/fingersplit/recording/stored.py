"""Everything that is made of a plan saved with ``Plan.save_traces``: pictures, thumbnails, animations, recordings."""

from pathlib import Path

import numpy as np

from fingersplit.hands.hand import Hand, load_hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.recording.moving_picture import draw_moving_picture, draw_thumbnail
from fingersplit.recording.picture import QualityCurve, draw_grasp
from fingersplit.recording.recorded_run import RecordedRun
from fingersplit.recording.scene import GraspView
from fingersplit.splitting.trace import PHASE_NAMES, QUALITY, Trace

__all__ = ["animate_stored", "draw_stored", "record_stored", "thumbnail_stored"]


def draw_stored(traces: Path, mesh: Mesh, rank: int, png: Path) -> None:
    """Draw one ranked grasp: hand and object at the start and at the end, beside the quality curve.

    Args:
        traces: File that ``Plan.save_traces`` wrote.
        mesh: The object it was planned for.
        rank: Rank of the grasp, from 1.
        png: Picture to write.

    Raises:
        KeyError: The plan has no grasp of that rank.
    """
    run, hand = RecordedRun.from_file(traces, rank), _hand(traces)
    curve = QualityCurve(
        quality=run.trace.scores[:, QUALITY],
        phases=[PHASE_NAMES[phase] for phase in run.trace.phases],
        residual=run.trace.residuals.max(axis=1),
    )
    states = _view(run.trace, 0), _view(run.trace, -1)
    with np.load(traces, allow_pickle=False) as stored:
        title = str(stored[f"{rank}/title"])
    draw_grasp(png, mesh=mesh, hand=hand, states=states, curve=curve, title=title)


def thumbnail_stored(traces: Path, mesh: Mesh, rank: int, webp: Path) -> None:
    """Draw one ranked grasp as a small picture for lists; arguments as for ``draw_stored``."""
    run = RecordedRun.from_file(traces, rank)
    draw_thumbnail(webp, mesh, _hand(traces), _view(run.trace, -1))


def animate_stored(traces: Path, mesh: Mesh, rank: int, webp: Path) -> None:
    """Draw how one ranked grasp came about as a moving picture; arguments as for ``draw_stored``."""
    run = RecordedRun.from_file(traces, rank)
    draw_moving_picture(webp, mesh, _hand(traces), [_view(run.trace, row) for row in range(len(run.trace))])


def record_stored(traces: Path, model: ObjectModel, rank: int, rrd: Path, friction: float) -> None:
    """Write the recording of one ranked grasp.

    Args:
        traces: File that ``Plan.save_traces`` wrote.
        model: The object it was planned for.
        rank: Rank of the grasp, from 1.
        rrd: Recording to write.
        friction: Coulomb friction coefficient it was planned with.

    Raises:
        KeyError: The plan has no grasp of that rank.
    """
    from fingersplit.recording.run_recording import write_recording  # loads rerun: only who records

    write_recording(rrd, model, _hand(traces), RecordedRun.from_file(traces, rank), friction)


def _hand(traces: Path) -> Hand:
    with np.load(traces, allow_pickle=False) as stored:
        return load_hand(str(stored["hand"]))


def _view(trace: Trace, row: int) -> GraspView:
    return GraspView(trace.object_from_palm(row), trace.joints[row], trace.contacts[row], trace.normals[row])
