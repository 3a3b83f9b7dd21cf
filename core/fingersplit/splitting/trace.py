"""What a run did, state by state."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.limits import MAX_FINGERS, MAX_JOINTS
from fingersplit.transforms import pose_matrix

__all__ = [
    "HAND_QUALITY",
    "OBJECT_QUALITY",
    "PENETRATION",
    "PHASE_NAMES",
    "QUALITY",
    "Trace",
    "TraceRows",
    "new_trace",
]

PHASE_NAMES = ("cpo", "ppo", "map", "settle")

QUALITY, OBJECT_QUALITY, HAND_QUALITY, PENETRATION = range(4)
"""Columns of ``Trace.scores``."""

ROW = np.dtype(
    [
        ("phase", np.int64),
        ("joints", np.float64, MAX_JOINTS),
        ("palm_rotation", np.float64, (3, 3)),
        ("palm_position", np.float64, 3),
        ("contacts", np.float64, (MAX_FINGERS, 3)),
        ("normals", np.float64, (MAX_FINGERS, 3)),
        ("residuals", np.float64, MAX_FINGERS),
        ("pad_angles", np.float64, MAX_FINGERS),
        ("scores", np.float64, 4),
        ("contact_steps", np.float64, (MAX_FINGERS, 3)),
    ],
    align=True,
)
"""One recorded state; columns as in ``Trace``."""


class TraceRows(NamedTuple):
    """Room for recorded states, none if nothing is to be recorded; ``length`` (1,) counts the rows in use."""

    rows: np.recarray
    length: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Trace:
    """Every accepted state of one run, the mapped start first.

    Attributes:
        phases: What led to the state, an index into ``PHASE_NAMES``, (T,).
        joints: Joint angles, (T, N) [rad].
        palm_rotations: ``object_from_palm`` rotations, (T, 3, 3).
        palm_positions: Palm origins, (T, 3) [m].
        contacts: Contact points, (T, F, 3) [m].
        normals: Outward surface normals, (T, F, 3).
        residuals: Fingertip to contact, (T, F) [m].
        pad_angles: Pad normal to inward surface normal, (T, F) [rad].
        scores: Q, w1 Q_o, w2 Q_h, penetration [m], (T, 4).
        contact_steps: Tangent step d_c of the contacts that CPO took from the state before, Algorithm 1 line 3 of
            [Fan2018]; zero after any other phase, (T, F, 3) [m].
    """

    phases: NDArray[np.int64]
    joints: NDArray[np.float64]
    palm_rotations: NDArray[np.float64]
    palm_positions: NDArray[np.float64]
    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    residuals: NDArray[np.float64]
    pad_angles: NDArray[np.float64]
    scores: NDArray[np.float64]
    contact_steps: NDArray[np.float64]

    @classmethod
    def from_rows(cls, trace: TraceRows, fingers: int, joints: int) -> Self:
        """Copy of the rows in use, read-only."""
        rows: Any = trace.rows[: trace.length[0]]
        columns = {
            "phases": rows.phase,
            "joints": rows.joints[:, :joints],
            "palm_rotations": rows.palm_rotation,
            "palm_positions": rows.palm_position,
            "contacts": rows.contacts[:, :fingers],
            "normals": rows.normals[:, :fingers],
            "residuals": rows.residuals[:, :fingers],
            "pad_angles": rows.pad_angles[:, :fingers],
            "scores": rows.scores,
            "contact_steps": rows.contact_steps[:, :fingers],
        }
        copies = {name: np.array(column) for name, column in columns.items()}
        for column in copies.values():
            column.setflags(write=False)
        return cls(**copies)

    def __len__(self) -> int:
        return len(self.phases)

    def object_from_palm(self, row: int) -> NDArray[np.float64]:
        """Palm pose of a row, (4, 4)."""
        return pose_matrix(self.palm_rotations[row], self.palm_positions[row])


def new_trace(capacity: int) -> TraceRows:
    """Room for ``capacity`` states."""
    return TraceRows(np.rec.array(np.zeros(capacity, ROW)), np.zeros(1, np.int64))
