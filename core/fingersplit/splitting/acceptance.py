"""Line 7 of Algorithms 1 and 2: whether a step may be taken, or what stops the phase.

Starts may be infeasible, so a test only stops a step that breaks a bound that held or makes a violated one worse; and
the quality test waits while a fingertip is still being pulled to the surface, since that may cost quality.
"""

from fingersplit.compilation import kernel
from fingersplit.splitting.state import PENETRATION, QUALITY, measure_collision

__all__ = [
    "CONTINUE",
    "REACHED_COLLISION",
    "REACHED_ITERATION_LIMIT",
    "REACHED_PAD_ANGLE",
    "STOPPED_RISING",
    "judge",
    "judge_collision",
    "judge_pads",
]

CONTINUE, STOPPED_RISING, REACHED_PAD_ANGLE, REACHED_COLLISION, REACHED_ITERATION_LIMIT = range(5)

LEAST_PULL = 0.01
"""Share by which a step must shorten the largest residual to count as pulling."""


@kernel
def judge(settings, state, candidate, least_increase):
    """Quality and pad angles of ``candidate`` against ``state``; CONTINUE when both allow the step."""
    before, after = state.residuals.max(), candidate.residuals.max()
    pulled = before > settings.contact_tolerance and after < (1.0 - LEAST_PULL) * before
    if not pulled and candidate.scores[QUALITY] - state.scores[QUALITY] <= least_increase:
        return STOPPED_RISING
    return judge_pads(settings, state, candidate)


@kernel
def judge_pads(settings, state, candidate):
    """Pad angles of ``candidate`` against ``state``."""
    for finger in range(state.pad_angles.size):
        if candidate.pad_angles[finger] > max(settings.pad_angle_limit, state.pad_angles[finger]):
            return REACHED_PAD_ANGLE
    return CONTINUE


@kernel
def judge_collision(problem, state, candidate):
    """Penetration of ``candidate``, measured here, against ``state``."""
    measure_collision(problem, candidate)
    allowed = max(problem.settings.penetration_tolerance, state.scores[PENETRATION])
    return REACHED_COLLISION if candidate.scores[PENETRATION] > allowed else CONTINUE
