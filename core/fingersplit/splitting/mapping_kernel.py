"""The Map of Algorithm 3, line 2: a parallel grasp becomes a start for the multi-fingered hand.

The palm takes the gripper's place: its approach axis along v_ap, its jaw axis through c_1 and c_2, the fingers of
either group about their jaw's contact. How far the palm stands off and how the fingers are preshaped is searched: all
combinations are screened with the joints that the hand's jaw table knows, by reach, pad alignment and clearance; the
best few are brought to the surface, and the best of those is the start.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.objects.signed_distance_kernel import sample_near
from fingersplit.objects.surface_kernel import closest
from fingersplit.scene.obstacles_kernel import rough_violation
from fingersplit.splitting.collision_kernel import rough_penetration
from fingersplit.splitting.pull_kernel import pull_pads, take_pose
from fingersplit.splitting.state_kernel import attach_contacts, evaluate, measure_collision, measure_pads
from fingersplit.vectors_kernel import add, cross, dot, get, norm, put, scale, subtract

__all__ = ["REFINED", "map_grasp", "screen_grasp"]

REFINED = 2
"""Combinations of preshape and standoff that are brought to the surface."""
FACING_ITERATIONS, CLOSING_ITERATIONS = 8, 2
"""Most steps that bring all pads to the surface and turn them to face it, and most that then close the gaps alone."""
SETTLED = 1e-4
"""[rad]; drivers that turn less move a pad by about 0.01 mm."""
DAMPING = 1e-2
"""[m/rad]; of these steps: a tenth of a finger's reach."""
FACING = 2e-2
"""[m]; a radian between pad and surface counts as much as this gap."""
PAD_ANGLE_SCALE = 0.4
"""[rad]; a pad tilted this much costs 1."""
REACH_SCALE = 2e-3
"""[m]; a fingertip this far from its contact costs 1."""
SCREENING_REACH_SCALE = 30e-3
"""[m]; the same before the fingertips have moved."""
MAX_TABLED = 0.01
"""[m]; entries of the jaw table whose pads stay farther from the contacts are out of reach."""
CLEARANCE_SCALE = 2e-3
"""[m]; a link this deep in the object costs 1."""
EXACTLY_AIMED = 5e-3
"""[m]; aims beside the object are farther off and need not be exact."""
SCREENING_CLEARANCE_SCALE = 4e-3
"""[m]; the same as the screening sees it."""
OUT_OF_REACH = 0.02
"""[m]; a start whose fingertips stay farther from their contacts is dropped."""


@kernel
def screen_grasp(problem, table, first, second, approach, states, work, costs, choices):
    """The ``REFINED`` most promising combinations of preshape and standoff for the jaw contacts of a parallel grasp.

    Reach and alignment of all combinations come first; collisions, which cost more, are measured from the best on until
    no other can get among the chosen.

    Args:
        problem: ``Problem``.
        table: ``JawTable`` of the hand.
        first: Contact of the fingers in group 0 [m].
        second: Contact of the fingers in group 1 [m].
        approach: Direction of travel towards the object.
        states: Scratch, one ``STATE`` record.
        work: ``WORK`` record.
        costs: Gets their costs in rising order, infinite where there is none, (REFINED,).
        choices: Gets preshape and standoff of each, -1 where there is none, (REFINED, 2) int64.
    """
    hand, settings, state = problem.hand, problem.settings, states[0]
    lateral, jaw, forward, middle, opening = _jaw_frame(first, second, approach)
    costs[:] = math.inf
    choices[:] = -1
    w = _opening_index(table, opening)
    if w < 0:
        return
    combinations = work.map.combinations
    for p in range(len(table.drivers)):
        _aim(problem, table, p, first, second, lateral, state)
        for h in range(len(table.standoffs)):
            combinations[p, h] = math.inf
            if table.errors[p, w, h] < MAX_TABLED:
                _place(hand, table, p, w, h, lateral, jaw, forward, middle, state)
                evaluate(hand, settings, state)
                combinations[p, h] = _cost(hand, state, SCREENING_REACH_SCALE)
    while True:
        p, h = _cheapest(combinations, len(table.drivers), len(table.standoffs))
        cost = combinations[p, h]
        if not cost < costs[-1]:
            return
        combinations[p, h] = math.inf
        _place(hand, table, p, w, h, lateral, jaw, forward, middle, state)
        enough = SCREENING_CLEARANCE_SCALE * math.sqrt(costs[-1] - cost)  # what is deeper is not chosen
        depth = _rough_violation(problem.scene, hand, state, work, enough)
        if depth < enough:
            depth += rough_penetration(hand, state, problem.distance, enough - depth)
        _insert(costs, choices, cost + (depth / SCREENING_CLEARANCE_SCALE) ** 2, p, h)


@kernel
def map_grasp(problem, table, first, second, approach, choices, states, work, times):
    """The start of a screened parallel grasp into ``states[0]``; ``states[1]`` and ``states[2]`` are scratch.

    ``choices`` are those of ``screen_grasp``; ``times`` is a ``PHASE_TIMES`` record, added to.

    Returns:
        Cost of the start, sum of squares over the scales above; infinite when the fingertips do not come near.
    """
    hand, settings, candidate = problem.hand, problem.settings, states[1]
    lateral, jaw, forward, middle, opening = _jaw_frame(first, second, approach)
    w = _opening_index(table, opening)
    best = math.inf
    for choice in choices:
        p, h = choice
        if p < 0:
            continue
        _aim(problem, table, p, first, second, lateral, candidate)
        _place(hand, table, p, w, h, lateral, jaw, forward, middle, candidate)
        _reach(problem, candidate, states[2], work)
        evaluate(hand, settings, candidate)
        if candidate.residuals[: hand.finger_count].max() > OUT_OF_REACH:
            continue
        measure_collision(problem, candidate, work, times)
        cost = _cost(hand, candidate, REACH_SCALE) + (candidate.penetration / CLEARANCE_SCALE) ** 2
        cost += (max(-candidate.around.least, 0.0) / CLEARANCE_SCALE) ** 2
        if cost < best:
            best = cost
            states[0] = states[1]
    return best


@kernel
def _rough_violation(scene, hand, state, work, enough):
    """About how much clearance the hand lacks from what stands around the object [m], see ``rough_violation``."""
    return 0.0 if scene is None else rough_violation(scene, hand, state, work.around, enough)


@kernel
def _opening_index(table, opening):
    """The nearest opening of the table; -1 when it has none near."""
    w = round((opening - table.openings[0]) / (table.openings[1] - table.openings[0]))
    return w if 0 <= w < len(table.openings) else -1


@kernel
def _cheapest(combinations, preshapes, standoffs):
    best = (0, 0)
    for p in range(preshapes):
        for h in range(standoffs):
            if combinations[p, h] < combinations[best]:
                best = (p, h)
    return best


@kernel
def _jaw_frame(first, second, approach):
    """Lateral, jaw and approach axis of a parallel grasp, the middle of its contacts and their distance [m]."""
    jaw = subtract(first, second)
    opening = norm(jaw)
    jaw = scale(1.0 / opening, jaw)
    forward = subtract(approach, scale(dot(approach, jaw), jaw))
    forward = scale(1.0 / norm(forward), forward)
    return cross(jaw, forward), jaw, forward, scale(0.5, add(first, second)), opening


@kernel
def _place(hand, table, p, w, h, lateral, jaw, forward, middle, state):
    """Palm with the jaw centre at ``middle`` and joints of a table entry."""
    W = table.palm_from_gripper
    x, y, z = table.center[0], table.center[1], table.standoffs[h]
    for i in range(3):
        for k in range(3):
            state.palm_rotation[i, k] = lateral[i] * W[k, 0] + jaw[i] * W[k, 1] + forward[i] * W[k, 2]
        state.palm_position[i] = middle[i] - (x * lateral[i] + y * jaw[i] + z * forward[i])
    state.drivers[: hand.driver_count] = table.drivers[p, w, h]
    move_drivers(hand, state)


@kernel
def _aim(problem, table, p, first, second, lateral, state):
    """Contacts of the fingers: about their jaw's contact, as far to the side as their pads stand in the preshape."""
    for finger in range(problem.hand.finger_count):
        jaw_contact = first if table.groups[finger] == 0 else second
        aimed = add(jaw_contact, scale(table.lateral_offsets[p, finger], lateral))
        sample = sample_near(problem.distance, aimed)
        point, normal = get(problem.surface.grid.points, sample), get(problem.surface.normals, sample)
        if norm(subtract(aimed, point)) < EXACTLY_AIMED:
            sample, point, normal = closest(problem.surface, aimed, sample)
        state.samples[finger] = sample
        put(state.contacts, finger, point)
        put(state.normals, finger, normal)


@kernel
def _reach(problem, state, scratch, work):
    """Pull all pads to the surface and turn them to face it; their contacts follow them from the start.

    Aims that stay where the two contacts are have no hold on joints that turn a pad about itself: on small objects
    Barrett's spread ran into its limit.
    """
    _pull(problem, state, FACING, FACING_ITERATIONS, scratch, work)
    _pull(problem, state, 0.0, CLOSING_ITERATIONS, scratch, work)


@kernel
def _pull(problem, state, facing, iterations, scratch, work):
    """Pull until the pads have settled, at most so often; the contacts are attached in the end."""
    hand = problem.hand
    attach_contacts(problem.surface, hand, state)
    for _ in range(iterations):
        measure_pads(hand, state)
        pull_pads(problem, state, DAMPING, facing, False, work, scratch)
        longest = 0.0
        for a in range(hand.driver_count):
            longest = max(longest, abs(scratch.drivers[a] - state.drivers[a]))
        take_pose(hand, scratch, state)
        attach_contacts(problem.surface, hand, state)
        if longest < SETTLED:
            return


@kernel
def _cost(hand, state, reach_scale):
    cost = 0.0
    for finger in range(hand.finger_count):
        cost += (state.residuals[finger] / reach_scale) ** 2 + (state.pad_angles[finger] / PAD_ANGLE_SCALE) ** 2
    return cost


@kernel
def _insert(costs, choices, cost, p, h):
    """Keep the lists of best costs and choices sorted."""
    place = len(costs)
    while place > 0 and cost < costs[place - 1]:
        place -= 1
    for i in range(len(costs) - 1, place, -1):
        costs[i], choices[i, 0], choices[i, 1] = costs[i - 1], choices[i - 1, 0], choices[i - 1, 1]
    if place < len(costs):
        costs[place], choices[place, 0], choices[place, 1] = cost, p, h
