"""Line 7 of Algorithms 1 and 2: whether a step may be taken, or what stops the phase.

Starts may be infeasible, so a test only stops a step that breaks a bound that held or makes a violated one worse; and
the quality test waits while a fingertip is still being pulled to the surface, since that may cost quality.
"""

from fingersplit.compilation import kernel
from fingersplit.splitting.self_collision_kernel import measure_self_clearance
from fingersplit.splitting.state_kernel import measure_collision

__all__ = [
    "CONTINUE",
    "REACHED_COLLISION",
    "REACHED_ITERATION_LIMIT",
    "REACHED_OBSTACLE",
    "REACHED_PAD_ANGLE",
    "REACHED_REGION",
    "STOPPED_RISING",
    "judge",
    "judge_collision",
    "judge_pads",
    "judge_surroundings",
]

CONTINUE, STOPPED_RISING, REACHED_PAD_ANGLE, REACHED_COLLISION, REACHED_ITERATION_LIMIT = range(5)
REACHED_OBSTACLE, REACHED_REGION = range(5, 7)

MIN_PULL = 0.01
"""Share by which a step must shorten the largest residual to count as pulling."""


@kernel
def judge(problem, state, candidate, least_increase, work, times):
    """Whether ``candidate`` may follow ``state``: CONTINUE, or what refuses it.

    Its collisions are measured here, first when potentials make them part of the merit, else last; the time is added
    to the phase's ``times``.
    """
    hand, settings = problem.hand, problem.settings
    if settings.potentials:
        measure_collision(problem, candidate, work, times)
    improves = candidate.merit - state.merit > least_increase
    if not improves and not _pulled(hand, settings, state, candidate):
        return STOPPED_RISING
    pads = judge_pads(hand, settings, state, candidate)
    if pads != CONTINUE:
        return pads
    if not settings.potentials:
        measure_collision(problem, candidate, work, times)
    collision = judge_collision(settings, state, candidate)
    if collision == CONTINUE:
        collision = judge_surroundings(problem.scene, hand, state, candidate)
    return collision if collision != CONTINUE else _judge_links(hand, settings, state, candidate, work)


@kernel
def _judge_links(hand, settings, state, candidate, work):
    """Whether links of ``candidate``, measured here, come too near to each other, and nearer than in ``state``."""
    measure_self_clearance(hand, candidate, work.own)
    least = min(-settings.penetration_tolerance, state.self_clearance)
    return REACHED_COLLISION if candidate.self_clearance < least else CONTINUE


@kernel
def _pulled(hand, settings, state, candidate):
    """Whether a fingertip that is off the surface is being pulled there."""
    before, after = 0.0, 0.0
    for finger in range(hand.finger_count):
        before, after = max(before, state.residuals[finger]), max(after, candidate.residuals[finger])
    return before > settings.contact_tolerance and after < (1.0 - MIN_PULL) * before


@kernel
def judge_pads(hand, settings, state, candidate):
    """Pad angles of ``candidate`` against ``state``."""
    for finger in range(hand.finger_count):
        limit = settings.pad_angle_limit * hand.pad_angle_scales[finger]
        if candidate.pad_angles[finger] > max(limit, state.pad_angles[finger]):
            return REACHED_PAD_ANGLE
    return CONTINUE


@kernel
def judge_collision(settings, state, candidate):
    """Penetration of ``candidate`` against ``state``, both measured."""
    allowed = max(settings.penetration_tolerance, state.penetration)
    return REACHED_COLLISION if candidate.penetration > allowed else CONTINUE


@kernel
def judge_surroundings(scene, hand, state, candidate):
    """Slack from obstacles and regions of contacts of ``candidate`` against ``state``, both measured."""
    if scene is None:
        return CONTINUE
    if candidate.around.least < min(state.around.least, 0.0):
        return REACHED_OBSTACLE
    for finger in range(hand.finger_count):
        if scene.admitted[state.samples[finger]] and not scene.admitted[candidate.samples[finger]]:
            return REACHED_REGION
    return CONTINUE
