"""What is made of a plan's traces file (``save_traces``): pictures, thumbnails, animations, recordings."""

from pathlib import Path

from fingersplit.hands.hand import load_hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.recording.moving_picture import draw_moving_picture, draw_thumbnail
from fingersplit.recording.picture import QualityCurve, draw_grasp
from fingersplit.recording.recorded_run import RecordedRun
from fingersplit.recording.scene import GraspView
from fingersplit.recording.traces_file import load_run
from fingersplit.splitting.trace import PHASE_NAMES, QUALITY, Trace

__all__ = ["animate_stored", "draw_stored", "record_stored", "thumbnail_stored"]


def draw_stored(traces: Path, mesh: Mesh, rank: int, png: Path) -> None:
    """Draw one ranked grasp: hand and object at the start and at the end, beside the quality curve.

    Args:
        traces: File that ``save_traces`` wrote.
        mesh: The object it was planned for.
        rank: Rank of the grasp, from 1.
        png: Picture to write.

    Raises:
        KeyError: The plan has no grasp of that rank.
    """
    stored = load_run(traces, rank)
    trace = Trace(**stored.trace)
    curve = QualityCurve(
        quality=trace.scores[:, QUALITY],
        phases=[PHASE_NAMES[phase] for phase in trace.phases],
        residual=trace.residuals.max(axis=1),
    )
    states = _view(trace, 0), _view(trace, -1)
    draw_grasp(png, mesh=mesh, hand=load_hand(stored.hand), states=states, curve=curve, title=stored.title)


def thumbnail_stored(traces: Path, mesh: Mesh, rank: int, webp: Path) -> None:
    """Draw one ranked grasp as a small picture for lists; arguments as for ``draw_stored``."""
    stored = load_run(traces, rank)
    draw_thumbnail(webp, mesh, load_hand(stored.hand), _view(Trace(**stored.trace), -1))


def animate_stored(traces: Path, mesh: Mesh, rank: int, webp: Path) -> None:
    """Draw how one ranked grasp came about as a moving picture; arguments as for ``draw_stored``."""
    stored = load_run(traces, rank)
    trace = Trace(**stored.trace)
    draw_moving_picture(webp, mesh, load_hand(stored.hand), [_view(trace, row) for row in range(len(trace))])


def record_stored(traces: Path, model: ObjectModel, rank: int, rrd: Path, friction: float) -> None:
    """Write the recording of one ranked grasp.

    Args:
        traces: File that ``save_traces`` wrote.
        model: The object it was planned for.
        rank: Rank of the grasp, from 1.
        rrd: Recording to write.
        friction: Coulomb friction coefficient it was planned with.

    Raises:
        KeyError: The plan has no grasp of that rank.
    """
    from fingersplit.recording.run_recording import write_recording  # loads rerun: only who records

    stored = load_run(traces, rank)
    write_recording(rrd, model, load_hand(stored.hand), RecordedRun.from_stored(stored), friction)


def _view(trace: Trace, row: int) -> GraspView:
    return GraspView(trace.object_from_palm(row), trace.joints[row], trace.contacts[row], trace.normals[row])
