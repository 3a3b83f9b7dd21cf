"""The cheap look at a grasp's robustness: fingers closed kinematically about a displaced object, and flat surroundings.

The fingers go from the pre-grasp opening over the planned joints to the squeeze targets; each stops where its pad
touches. Objects do not move and links do not collide, so this tells which fingers arrive, and where; not what they do
to the object.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_fingers
from fingersplit.objects.grid_kernel import cell_range
from fingersplit.objects.signed_distance_kernel import least_distance
from fingersplit.objects.surface_kernel import closest
from fingersplit.splitting.collision_kernel import rough_penetration
from fingersplit.vectors_kernel import (
    add,
    angle_between,
    dot,
    get,
    norm,
    put,
    rotate_back,
    scale,
    subtract,
    vector,
)

__all__ = ["close_hands", "look_around"]

TOUCHES = 0.3e-3
"""[m]; pads this near have arrived."""
NEAR = 3e-3
"""[m]; farther away the distance grid is exact enough."""
STEPS = 16
"""Most steps of a closing."""
NO_GRIP = -0.5
"""[rad]; slack that counts where a finger does not arrive."""
BEYOND = 0.4
"""Share of the way from the opening to the planned joints that servos go on at most."""
OTHER_SIDE = -0.5
"""Cosine to the contact's normal below which a sample lies on the far side of a thin part."""


@kernel
def close_hands(hand, surface, distance, center, poses, opened, closed, draws, work, means):
    """Close the hand of each of n grasps about the object in every draw.

    After the joints of the grasp the fingers go on in the same direction, by ``BEYOND`` of the way.

    Args:
        hand: ``HAND`` record.
        surface: ``Surface`` of the object.
        distance: ``DistanceGrid`` of the object.
        center: Its centre of mass [m].
        poses: ``object_from_palm``, (n, 4, 4).
        opened: Joints from which the fingers close, (n, N) [rad].
        closed: Joints of the grasps, (n, N) [rad].
        draws: ``ClosingDraws``.
        work: ``CLOSING_WORK`` record.
        means: Gets means over the draws, (n, 7): share in which all pads arrive; share of pads that arrive; angle that
            the worst contact is inside its friction cone [rad]; share in which all arrive and that is positive; length
            by which fingers arrive apart [m]; depth of links in the object at the end [m]; angle of the worst pad
            [rad].
    """
    for n in range(len(poses)):
        _plan_closing(hand, poses[n], opened[n], closed[n], work)
        _close_hand(hand, surface, distance, center, draws, work, means[n])


@kernel
def _plan_closing(hand, pose, opened, closed, work):
    """Palm and postures of a closing into ``work``, and how far the pads go between the postures."""
    palm, postures = work.palm, work.postures
    for j in range(len(closed)):
        postures[0, j], postures[1, j] = opened[j], closed[j]
        postures[2, j] = closed[j] + BEYOND * (closed[j] - opened[j])
    for i in range(3):
        palm.palm_position[i] = pose[i, 3]
        for j in range(3):
            palm.palm_rotation[i, j] = pose[i, j]
    for phase in range(3):
        for j in range(len(closed)):
            palm.joints[j] = postures[phase, j]
        move_fingers(hand, palm)
        for f in range(hand.finger_count):
            if phase > 0:
                work.speeds[f, phase - 1] = norm(subtract(get(palm.pads, f), get(work.contacts, f)))
            put(work.contacts, f, get(palm.pads, f))


@kernel
def _close_hand(hand, surface, distance, center, draws, work, sums):
    """The means of one grasp."""
    sums[:] = 0.0
    pose, palm, postures, fingers = work.pose, work.palm, work.postures, hand.finger_count
    for d in range(len(draws.rotations)):
        _displace(palm, pose, draws.rotations[d], get(draws.displacements, d), center)
        arrived = _close(hand, surface, distance, postures, pose, work)
        everyone = arrived == fingers
        slack, tilt, apart = NO_GRIP, math.pi / 2, 0.0
        if everyone:
            slack = _grip_slack(work, fingers) + math.atan(draws.frictions[d])
            tilt, first, last = 0.0, math.inf, 0.0
            for f in range(fingers):
                tilt = max(tilt, angle_between(get(pose.pad_normals, f), scale(-1.0, get(work.normals, f))))
                first, last = min(first, work.travelled[f]), max(last, work.travelled[f])
            apart = last - first
        sums[0] += everyone
        sums[1] += arrived / fingers
        sums[2] += max(slack, NO_GRIP)
        sums[3] += everyone and slack > 0.0
        sums[4] += apart
        sums[5] += rough_penetration(hand, pose, distance, math.inf)
        sums[6] += tilt
    for k in range(len(sums)):
        sums[k] /= len(draws.rotations)


@kernel
def _displace(palm, pose, R, displacement, center):
    """The palm in the frame of an object that is turned by ``R`` about its centre and displaced."""
    offset = subtract(subtract(vector(palm.palm_position), center), displacement)
    placed = add(center, rotate_back(R, offset))
    for i in range(3):
        pose.palm_position[i] = placed[i]
        for j in range(3):
            pose.palm_rotation[i, j] = (
                R[0, i] * palm.palm_rotation[0, j]
                + R[1, i] * palm.palm_rotation[1, j]
                + R[2, i] * palm.palm_rotation[2, j]
            )


@kernel
def _close(hand, surface, distance, postures, pose, work):
    """Move every finger until its pad touches or its targets are reached; how many pads touch."""
    for f in range(hand.finger_count):
        work.shares[f], work.moving[f], work.touching[f], work.travelled[f] = 0.0, True, False, 0.0
        work.hints[f] = -1
    for _ in range(STEPS):
        for f in range(hand.finger_count):
            share = work.shares[f]
            for i in range(hand.joint_counts[f]):
                j = hand.joint_indices[f, i]
                if share <= 1.0:
                    pose.joints[j] = postures[0, j] + share * (postures[1, j] - postures[0, j])
                else:
                    pose.joints[j] = postures[1, j] + (share - 1.0) * (postures[2, j] - postures[1, j])
        move_fingers(hand, pose)
        moving = False
        for f in range(hand.finger_count):
            if work.moving[f]:
                gap = _gap(surface, distance, get(pose.pads, f), hand.pad_radii[f], f, work)
                _step(f, gap, work)
                moving = moving or work.moving[f]
        if not moving:
            break
    arrived = 0
    for f in range(hand.finger_count):
        arrived += work.touching[f]
    return arrived


@kernel
def _gap(surface, distance, pad, radius, f, work):
    """Distance of a pad from the surface, negative inside [m]; near it also the contact, into ``work``."""
    rough = least_distance(distance, pad) - radius
    if rough > NEAR:
        return rough
    sample, point, normal = closest(surface, pad, work.hints[f])
    work.hints[f] = sample
    put(work.contacts, f, point)
    put(work.normals, f, normal)
    offset = subtract(pad, point)
    length = norm(offset)
    return (length if dot(offset, normal) >= 0.0 else -length) - radius


@kernel
def _step(f, gap, work):
    """Stop a finger that has arrived or can go no farther, or move it on by its gap."""
    if gap < TOUCHES:
        work.moving[f], work.touching[f] = False, True
    elif work.shares[f] >= 2.0:
        work.moving[f] = False
    else:
        closing = work.shares[f] < 1.0
        speed = max(work.speeds[f, 0 if closing else 1], 1e-6)
        ends = 1.0 if closing else 2.0
        step = min(gap / speed, ends - work.shares[f])
        work.shares[f] += step
        work.travelled[f] += step * speed


@kernel
def _grip_slack(work, fingers):
    """Angle of the worst contact's normal from the pull of the others, negated [rad], at the best of few grips.

    Fingers pull to a common point: the mean of the contacts, or half way between one of them and the mean of the rest.
    """
    total = (0.0, 0.0, 0.0)
    for f in range(fingers):
        total = add(total, get(work.contacts, f))
    best = -math.pi
    for single in range(-1, fingers):
        if single < 0:
            meeting = scale(1.0 / fingers, total)
        else:
            one = get(work.contacts, single)
            meeting = add(scale(0.5, one), scale(0.5 / max(fingers - 1, 1), subtract(total, one)))
        worst = 0.0
        for f in range(fingers):
            pull = subtract(meeting, get(work.contacts, f))
            worst = max(worst, angle_between(pull, scale(-1.0, get(work.normals, f))))
        best = max(best, -worst)
    return best


@kernel
def look_around(surface, points, normals, radius, around):
    """Surroundings of contacts, (F, 3) [m] with outward normals, into ``around`` (F, 2).

    The mean angle of the normals within ``radius`` [rad], and how many samples there are for each spacing^2 of a plane.
    """
    grid = surface.grid
    expected = math.pi * radius * radius / (surface.spacing * surface.spacing)
    for f in range(len(points)):
        point, normal, total, count = get(points, f), get(normals, f), 0.0, 0
        low, high = cell_range(grid, point, radius)
        for x in range(low[0], high[0]):
            for y in range(low[1], high[1]):
                row = (x * grid.shape[1] + y) * grid.shape[2]
                for i in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                    there = get(surface.normals, i)
                    if norm(subtract(get(grid.points, i), point)) < radius and dot(normal, there) > OTHER_SIDE:
                        total += angle_between(normal, there)
                        count += 1
        around[f, 0], around[f, 1] = total / max(count, 1), count / expected
