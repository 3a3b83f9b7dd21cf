"""The kernel behind ``jaw_table``: joints that close on two opposite contacts."""

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.splitting.tracking_kernel import track
from fingersplit.vectors_kernel import dot, get, norm, put, subtract, vector

__all__ = ["fill_table"]

ITERATIONS = 20


@kernel
def fill_table(hand, preshapes, table, states, work):
    """Fill ``drivers``, ``errors`` and ``lateral_offsets`` of a ``JawTable`` from ``preshapes`` (P, A) [rad]."""
    state, count = states[0], hand.driver_count
    for i in range(3):
        state.palm_rotation[i, i] = 1.0
    for p in range(len(preshapes)):
        state.drivers[:count] = preshapes[p]
        move_drivers(hand, state)
        _measure_lateral_offsets(hand, table, p, vector(table.palm_from_gripper[:, 0]), state)
        for w in range(len(table.openings)):
            for h in range(len(table.standoffs)):
                state.drivers[:count] = preshapes[p]
                move_drivers(hand, state)
                table.errors[p, w, h] = _aim_pads(hand, table, p, w, h, state, work.step)
                for _ in range(ITERATIONS):
                    track(hand, state, work.step.displacements, work.solver, work.map.drivers)
                    state.drivers[:] = work.map.drivers
                    move_drivers(hand, state)
                    table.errors[p, w, h] = _aim_pads(hand, table, p, w, h, state, work.step)
                table.drivers[p, w, h] = state.drivers[:count]


@kernel
def _aim_pads(hand, table, p, w, h, state, step):
    """Displacements that bring all pads to their places in a table entry; the largest of them [m]."""
    W, farthest = table.palm_from_gripper, 0.0
    lateral, jaw, approach = vector(W[:, 0]), vector(W[:, 1]), vector(W[:, 2])
    for f in range(hand.finger_count):
        side = 1.0 if table.groups[f] == 0 else -1.0
        x = table.center[0] + table.lateral_offsets[p, f]
        y = table.center[1] + side * (0.5 * table.openings[w] + hand.pad_radii[f])
        z = table.standoffs[h]
        target = (
            x * lateral[0] + y * jaw[0] + z * approach[0],
            x * lateral[1] + y * jaw[1] + z * approach[1],
            x * lateral[2] + y * jaw[2] + z * approach[2],
        )
        gap = subtract(target, get(state.pads, f))
        put(step.displacements, f, gap)
        farthest = max(farthest, norm(gap))
    return farthest


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
