"""The kernel behind ``jaw_table``: joints that close on two opposite contacts."""

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_fingers
from fingersplit.splitting.tracking_kernel import track
from fingersplit.vectors_kernel import dot, get, norm, subtract, vector

__all__ = ["fill_table"]

ITERATIONS = 20


@kernel
def fill_table(hand, preshapes, table, states, work):
    """Fill ``joints``, ``errors`` and ``lateral_offsets`` of a ``JawTable`` from ``preshapes`` (P, N) [rad]."""
    state, count = states[0], hand.joint_count
    W = table.palm_from_gripper
    lateral, jaw, approach = vector(W[:, 0]), vector(W[:, 1]), vector(W[:, 2])
    for i in range(3):
        state.palm_rotation[i, i] = 1.0
    for p in range(len(preshapes)):
        state.joints[:count] = preshapes[p]
        move_fingers(hand, state)
        _measure_lateral_offsets(hand, table, p, lateral, state)
        for w in range(len(table.openings)):
            for h in range(len(table.standoffs)):
                state.joints[:count] = preshapes[p]
                work.map.joints[:] = state.joints  # joints of no finger stay
                for iteration in range(ITERATIONS + 1):
                    move_fingers(hand, state)
                    table.errors[p, w, h] = 0.0
                    for f in range(hand.finger_count):
                        side = 1.0 if table.groups[f] == 0 else -1.0
                        x = table.center[0] + table.lateral_offsets[p, f]
                        y = table.center[1] + side * (0.5 * table.openings[w] + hand.pad_radii[f])
                        z, pad = table.standoffs[h], get(state.pads, f)
                        target = (
                            x * lateral[0] + y * jaw[0] + z * approach[0],
                            x * lateral[1] + y * jaw[1] + z * approach[1],
                            x * lateral[2] + y * jaw[2] + z * approach[2],
                        )
                        gap = subtract(target, pad)
                        table.errors[p, w, h] = max(table.errors[p, w, h], norm(gap))
                        track(hand, state, f, gap, work.solver, work.map.joints)
                    if iteration < ITERATIONS:
                        state.joints[:] = work.map.joints
                table.joints[p, w, h] = state.joints[:count]


@kernel
def _measure_lateral_offsets(hand, table, p, lateral, state):
    """Lateral place of every pad about the mean of its jaw's pads."""
    for group in range(2):
        mean, members = 0.0, 0
        for f in range(hand.finger_count):
            if table.groups[f] == group:
                mean += dot(lateral, get(state.pads, f))
                members += 1
        for f in range(hand.finger_count):
            if table.groups[f] == group:
                table.lateral_offsets[p, f] = dot(lateral, get(state.pads, f)) - mean / members
