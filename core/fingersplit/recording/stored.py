"""Pictures of a plan that was saved with ``Plan.save_traces``."""

from pathlib import Path

import numpy as np

from fingersplit.hands.hand import load_hand
from fingersplit.objects.mesh import Mesh
from fingersplit.recording.picture import GraspView, QualityCurve, draw_grasp
from fingersplit.splitting.trace import PHASE_NAMES
from fingersplit.transforms import pose_matrix

__all__ = ["draw_stored"]


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
    with np.load(traces, allow_pickle=False) as stored:
        hand = load_hand(str(stored["hand"]))
        rotations, positions = stored[f"{rank}/palm_rotations"], stored[f"{rank}/palm_positions"]
        joints, contacts, normals = (stored[f"{rank}/{name}"] for name in ("joints", "contacts", "normals"))
        views = [
            GraspView(pose_matrix(rotations[row], positions[row]), joints[row], contacts[row], normals[row])
            for row in (0, -1)
        ]
        curve = QualityCurve(
            quality=stored[f"{rank}/scores"][:, 0],
            phases=[PHASE_NAMES[phase] for phase in stored[f"{rank}/phases"]],
            residual=stored[f"{rank}/residuals"].max(axis=1),
        )
        title = str(stored[f"{rank}/title"])
    draw_grasp(png, mesh=mesh, hand=hand, states=(views[0], views[1]), curve=curve, title=title)
