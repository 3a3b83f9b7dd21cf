"""The last look at a grasp that the splitting ended with, at the triangles themselves."""

from fingersplit.compilation import kernel
from fingersplit.feasibility.penetration_kernel import exact_penetration
from fingersplit.feasibility.violations_kernel import find_violations
from fingersplit.objects.grid_kernel import nearest
from fingersplit.objects.surface_kernel import touch
from fingersplit.splitting.self_collision_kernel import measure_self_clearance
from fingersplit.splitting.state_kernel import evaluate, measure_collision
from fingersplit.vectors_kernel import angle_between, dot, get, norm, put, scale, subtract

__all__ = ["inspect_grasp"]


@kernel
def inspect_grasp(problem, patches, state, work, times):
    """Contacts, pad angles, residuals and Q where pads touch the triangles, and whether those lie too deep in a link.

    What a cloud's view did not see is in the collision points alone; and a grasp that is not feasible anyway is as deep
    as they say.

    Args:
        problem: ``Problem``.
        patches: ``Patches`` of the object; in the problem every call of the search would pay for its arrays.
        state: ``STATE`` record of the grasp, changed.
        work: ``WORK`` record.
        times: ``PHASE_TIMES`` record, added to.

    Returns:
        Mask of the violated constraints, see ``find_violations``.
    """
    hand, surface, settings = problem.hand, problem.surface, problem.settings
    for finger in range(hand.finger_count):
        _, point = touch(surface, get(state.pads, finger), state.samples[finger])
        state.samples[finger] = nearest(surface.grid, point, state.samples[finger])
        put(state.contacts, finger, point)
        put(state.normals, finger, get(surface.normals, state.samples[finger]))
    evaluate(hand, settings, state)
    for finger in range(hand.finger_count):
        away = subtract(get(state.pads, finger), get(state.contacts, finger))
        outside = dot(away, get(state.normals, finger)) >= 0.0
        state.residuals[finger] = abs((norm(away) if outside else -norm(away)) - hand.pad_radii[finger])
        towards = scale(-1.0 if outside else 1.0, away)  # where on the cap it is that touches, be it an edge
        turned = angle_between(get(state.pad_normals, finger), towards)
        state.pad_angles[finger] = max(state.pad_angles[finger], turned)
    measure_collision(problem, state, work, times)
    measure_self_clearance(hand, state, work.own)
    violations = find_violations(hand, settings, problem.limits, state)
    if violations:
        return violations
    exact = exact_penetration(hand, state, patches, problem.distance, settings.penetration_tolerance)
    state.penetration = max(state.penetration, exact)
    return find_violations(hand, settings, problem.limits, state)
