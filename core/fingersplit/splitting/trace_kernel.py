"""Appending to ``TraceRows``, and the phases that a row can come from."""

from fingersplit.compilation import kernel

__all__ = ["CPO", "MAP", "PPO", "SETTLE", "record", "record_contact_steps"]

CPO, PPO, MAP, SETTLE = range(4)


@kernel
def record(trace, phase, state):
    """Append a state if there is room."""
    n = trace.length[0]
    if n == len(trace.rows):
        return
    row = trace.rows[n]
    row.phase = phase
    row.joints[:] = state.joints
    row.palm_rotation[:] = state.palm_rotation
    row.palm_position[:] = state.palm_position
    row.contacts[:] = state.contacts
    row.normals[:] = state.normals
    row.residuals[:] = state.residuals
    row.pad_angles[:] = state.pad_angles
    row.scores[0], row.scores[1], row.scores[2] = state.quality, state.object_quality, state.hand_quality
    row.scores[3] = state.penetration
    trace.length[0] = n + 1


@kernel
def record_contact_steps(trace, contact_steps):
    """Add to the last state the tangent step that led to it."""
    if len(trace.rows):
        trace.rows[trace.length[0] - 1].contact_steps[:] = contact_steps
