"""What a run did, state by state."""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.transforms import pose_matrix

__all__ = [
    "CPO",
    "MAP",
    "PHASE_NAMES",
    "PPO",
    "SETTLE",
    "Trace",
    "TraceArrays",
    "new_trace",
    "record",
    "record_contact_steps",
]

MAP, CPO, PPO, SETTLE = range(4)
PHASE_NAMES = ("map", "cpo", "ppo", "settle")


class TraceArrays(NamedTuple):
    """Room for T states; columns as in ``Trace``, ``length`` (1,) counts the rows in use."""

    length: NDArray[np.int64]
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
        contact_steps: Full tangent step d_c of the contacts that CPO took from the state before, Algorithm 1 line 3 of
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
    def from_arrays(cls, arrays: TraceArrays) -> Self:
        """Copy of the rows in use, read-only."""
        columns = {
            name: column[: arrays.length[0]].copy() for name, column in arrays._asdict().items() if name != "length"
        }
        for column in columns.values():
            column.setflags(write=False)
        return cls(**columns)

    def __len__(self) -> int:
        return len(self.phases)

    def object_from_palm(self, row: int) -> NDArray[np.float64]:
        """Palm pose of a row, (4, 4)."""
        return pose_matrix(self.palm_rotations[row], self.palm_positions[row])


def new_trace(capacity: int, fingers: int, joints: int) -> TraceArrays:
    """Room for ``capacity`` states of a hand."""
    return TraceArrays(
        length=np.zeros(1, np.int64),
        phases=np.zeros(capacity, np.int64),
        joints=np.zeros((capacity, joints)),
        palm_rotations=np.zeros((capacity, 3, 3)),
        palm_positions=np.zeros((capacity, 3)),
        contacts=np.zeros((capacity, fingers, 3)),
        normals=np.zeros((capacity, fingers, 3)),
        residuals=np.zeros((capacity, fingers)),
        pad_angles=np.zeros((capacity, fingers)),
        scores=np.zeros((capacity, 4)),
        contact_steps=np.zeros((capacity, fingers, 3)),
    )


@kernel
def record(trace, phase, state):
    """Append a state."""
    row = trace.length[0]
    trace.phases[row] = phase
    trace.joints[row] = state.pose.joints
    trace.palm_rotations[row] = state.pose.palm_rotation
    trace.palm_positions[row] = state.pose.palm_position
    trace.contacts[row] = state.contacts
    trace.normals[row] = state.normals
    trace.residuals[row] = state.residuals
    trace.pad_angles[row] = state.pad_angles
    trace.scores[row] = state.scores
    trace.length[0] = row + 1


@kernel
def record_contact_steps(trace, contact_steps):
    """Add to the last state the tangent step that led to it."""
    trace.contact_steps[trace.length[0] - 1] = contact_steps
