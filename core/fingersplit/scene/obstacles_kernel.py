"""How near the hand is to what stands around the object: slack of every link, and where it is least.

Slack is the distance to an obstacle less the clearance it must have, so what is negative violates. Primitives and
planes are met exactly; meshes and clouds as their points, culled by a coarse grid of lower bounds.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import place_on_link, place_shape
from fingersplit.hands.shapes_kernel import shape_distance, shape_distance_gradient
from fingersplit.objects.grid_kernel import cell_range, column_in_ball
from fingersplit.scene.convex_kernel import core_extent, shape_to_shape
from fingersplit.scene.obstacles import HALF_SPACE
from fingersplit.vectors_kernel import add, dot, get, norm, put, rotate, rotate_back, scale, subtract, vector

__all__ = ["least_bound", "measure_slacks", "point_slack", "rough_violation"]


@kernel
def measure_slacks(scene, hand, pose, found, work, near):
    """Slack of every collision shape from all obstacles into ``found``.

    Args:
        scene: ``SceneArrays``.
        hand: ``HAND`` record.
        pose: ``POSE`` or ``STATE`` record that is up to date.
        found: ``SLACKS`` record.
        work: ``OBSTACLE_WORK`` record.
        near: Slacks above this [m] are left infinite.

    Returns:
        The least slack [m], infinite when nothing is near.
    """
    for shape in range(hand.shape_count):
        found.slacks[shape] = math.inf
        found.obstacles[shape] = -1
        put(work.centers, shape, place_on_link(hand, pose, shape, get(hand.shape_positions, shape)))
    found.least = math.inf
    _meet_primitives(scene, 0, scene.planes, hand, pose, found, work, near)
    if len(scene.primitives) == scene.planes and len(scene.owners) == 0:
        return found.least
    middle, radius = _enclosing_ball(work.centers, hand.shape_radii, hand.shape_count)
    for p in range(scene.planes, len(scene.primitives)):
        primitive = scene.primitives[p]
        largest = max(primitive.clearance, primitive.pad_clearance)
        if _distance(primitive, middle) <= radius + largest + near:
            _meet_primitives(scene, p, p + 1, hand, pose, found, work, near)
    if len(scene.owners) > 0 and least_bound(scene, middle) <= radius + scene.inflation + near:
        _meet_points(scene, hand, pose, found, work, near)
    return found.least


@kernel
def _enclosing_ball(centers, radii, count):
    """Centre and radius [m] of a ball about the middle of ``count`` balls that holds all of them."""
    middle, radius = (0.0, 0.0, 0.0), 0.0
    for i in range(count):
        middle = add(middle, scale(1.0 / count, get(centers, i)))
    for i in range(count):
        radius = max(radius, norm(subtract(get(centers, i), middle)) + radii[i])
    return middle, radius


@kernel
def _meet_primitives(scene, first, last, hand, pose, found, work, near):
    for p in range(first, last):
        primitive = scene.primitives[p]
        for shape in range(hand.shape_count):
            center = get(work.centers, shape)
            clearance = primitive.pad_clearance if _carries_pad(hand, shape) else primitive.clearance
            limit = min(near, found.slacks[shape])
            if _distance(primitive, center) - hand.shape_radii[shape] - clearance >= limit:
                continue
            distance, point, away = _meet(primitive, hand, pose, shape, center, limit + clearance, work)
            if distance - clearance < limit:
                _note(found, shape, distance - clearance, point, away, primitive.obstacle)


@kernel
def _distance(primitive, point):
    """Signed distance [m] of a point from a primitive."""
    local = rotate_back(primitive.rotation, subtract(point, vector(primitive.position)))
    if primitive.kind == HALF_SPACE:
        return local[2]
    return shape_distance(primitive.kind, primitive.size, local[0], local[1], local[2])


@kernel
def _meet(primitive, hand, pose, shape, center, reach, work):
    """Distance of a shape from a primitive, the primitive's nearest point and the direction to it."""
    place_shape(hand, pose, shape, work.rotation)
    kind, size = hand.shape_kinds[shape], hand.shape_sizes[shape]
    if primitive.kind == HALF_SPACE:
        R = primitive.rotation
        away = (-R[0, 2], -R[1, 2], -R[2, 2])
        height = -dot(away, subtract(center, vector(primitive.position)))
        point = add(center, scale(height, away))
        return height - core_extent(kind, size, work.rotation, away), point, away
    return shape_to_shape(
        kind,
        size,
        work.rotation,
        center,
        primitive.kind,
        primitive.size,
        primitive.rotation,
        vector(primitive.position),
        reach,
        work.rows,
    )


@kernel
def _meet_points(scene, hand, pose, found, work, near):
    for shape in range(hand.shape_count):
        center = get(work.centers, shape)
        limit = min(near, found.slacks[shape])
        if least_bound(scene, center) - hand.shape_radii[shape] - scene.inflation >= limit:
            continue
        place_shape(hand, pose, shape, work.rotation)
        best, index = limit, -1
        for sphere in range(hand.sphere_starts[shape], hand.sphere_starts[shape + 1]):
            middle = place_on_link(hand, pose, shape, get(hand.sphere_centers, sphere))
            radius = hand.sphere_radii[sphere] + scene.inflation + max(best, 0.0)
            if least_bound(scene, middle) < radius:
                best, index = _search_ball(scene, hand, shape, work.rotation, center, middle, radius, best, index)
        if index >= 0:
            point = get(scene.points.points, index)
            local = rotate_back(work.rotation, subtract(point, center))
            away = shape_distance_gradient(hand.shape_kinds[shape], hand.shape_sizes[shape], local)
            _note(found, shape, best, point, rotate(work.rotation, away), scene.owners[index])


@kernel
def _search_ball(scene, hand, shape, rotation, center, middle, radius, best, index):
    """The point in a ball with the least slack to a shape, unless ``index`` has less."""
    grid, kind, size = scene.points, hand.shape_kinds[shape], hand.shape_sizes[shape]
    low, high = cell_range(grid, middle, radius)
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            first, last = column_in_ball(grid, x, y, middle, radius)
            for i in range(first, last):
                offset = subtract(get(grid.points, i), middle)
                if dot(offset, offset) < radius * radius:
                    local = rotate_back(rotation, subtract(get(grid.points, i), center))
                    slack = shape_distance(kind, size, local[0], local[1], local[2]) - scene.inflations[i]
                    if slack < best:
                        best, index = slack, i
    return best, index


@kernel
def _note(found, shape, slack, point, away, obstacle):
    found.slacks[shape] = slack
    found.obstacles[shape] = obstacle
    put(found.points, shape, point)
    put(found.normals, shape, away)
    found.least = min(found.least, slack)


@kernel
def _carries_pad(hand, shape):
    finger = hand.shape_fingers[shape]
    return finger >= 0 and hand.shape_links[shape] == hand.joint_counts[finger] - 1


@kernel
def least_bound(scene, point):
    """A distance [m] that all points are certainly away from ``point``, from the nearest grid point's."""
    nx, ny, nz = scene.bounds.shape
    fx = (point[0] - scene.origin[0]) / scene.cell
    fy = (point[1] - scene.origin[1]) / scene.cell
    fz = (point[2] - scene.origin[2]) / scene.cell
    # Zero stands first so that a NaN becomes 0, too, instead of an index outside the array.
    x, y = int(min(max(0.0, fx + 0.5), nx - 1.0)), int(min(max(0.0, fy + 0.5), ny - 1.0))
    z = int(min(max(0.0, fz + 0.5), nz - 1.0))
    bound = scene.bounds[x, y, z] - scene.cell * norm((fx - x, fy - y, fz - z))
    beyond = max(-fx, fx - (nx - 1.0), -fy, fy - (ny - 1.0), -fz, fz - (nz - 1.0))
    return max(bound, scene.margin + beyond * scene.cell if beyond > 0.0 else 0.0)


@kernel
def rough_violation(scene, hand, pose, work, enough):
    """About how much clearance the hand lacks [m], from spheres inside its links: cheap, and right to a few mm.

    What lacks ``enough`` or more [m] may lack more than is returned.
    """
    for sphere in range(hand.sphere_count):
        middle = place_on_link(hand, pose, hand.sphere_shapes[sphere], get(hand.sphere_centers, sphere))
        put(work.centers, sphere, middle)
    deepest = 0.0
    for p in range(scene.planes):
        deepest = _deepest_sphere(scene.primitives[p], hand, work, deepest)
    if deepest >= enough or (len(scene.primitives) == scene.planes and len(scene.owners) == 0):
        return deepest
    middle, radius = _enclosing_ball(work.centers, hand.sphere_insides, hand.sphere_count)
    for p in range(scene.planes, len(scene.primitives)):
        primitive = scene.primitives[p]
        if _distance(primitive, middle) <= radius + primitive.clearance:
            deepest = _deepest_sphere(primitive, hand, work, deepest)
            if deepest >= enough:
                return deepest
    if len(scene.owners) > 0 and least_bound(scene, middle) <= radius + scene.inflation:
        for sphere in range(hand.sphere_count):
            center = get(work.centers, sphere)
            if least_bound(scene, center) < hand.sphere_insides[sphere] + scene.inflation:
                deepest = max(deepest, _deepest_point(scene, center, hand.sphere_insides[sphere]))
                if deepest >= enough:
                    return deepest
    return deepest


@kernel
def _deepest_sphere(primitive, hand, work, deepest):
    """How much clearance the spheres inside the links lack from a primitive [m], unless ``deepest`` is more."""
    for sphere in range(hand.sphere_count):
        pad = _carries_pad(hand, hand.sphere_shapes[sphere])
        clearance = primitive.pad_clearance if pad else primitive.clearance
        depth = hand.sphere_insides[sphere] + clearance - _distance(primitive, get(work.centers, sphere))
        deepest = max(deepest, depth)
    return deepest


@kernel
def _deepest_point(scene, middle, inside):
    """How deep the deepest point lies in a ball [m], the points' inflations included; 0 when none does."""
    grid, deepest, radius = scene.points, 0.0, inside + scene.inflation
    low, high = cell_range(grid, middle, radius)
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            first, last = column_in_ball(grid, x, y, middle, radius)
            for i in range(first, last):
                away = norm(subtract(get(grid.points, i), middle))
                deepest = max(deepest, inside + scene.inflations[i] - away)
    return deepest


@kernel
def point_slack(scene, point, near):
    """Slack [m] of a point from everything around; ``near`` [m] where it is more."""
    least = near
    for p in range(len(scene.primitives)):
        least = min(least, _distance(scene.primitives[p], point) - scene.primitives[p].clearance)
    if len(scene.owners) > 0 and least_bound(scene, point) - scene.inflation < least:
        least = min(least, near - _deepest_point(scene, point, near))
    return least
