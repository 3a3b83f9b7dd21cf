"""What follows from a state's pose: contacts, residuals, quality, clearances."""

from fingersplit.compilation import kernel
from fingersplit.objects.surface_kernel import closest
from fingersplit.scene.obstacles import NEAR
from fingersplit.scene.obstacles_kernel import measure_slacks
from fingersplit.splitting.clock_kernel import seconds
from fingersplit.splitting.collision_kernel import measure_clearances
from fingersplit.splitting.objective_kernel import manipulability, object_quality
from fingersplit.splitting.potential_kernel import penalty
from fingersplit.vectors_kernel import add, angle_between, get, norm, put, scale, subtract

__all__ = ["attach_contacts", "evaluate", "measure_collision", "measure_pads", "pad_target"]


@kernel
def pad_target(hand, state, finger):
    """Where the pad's centre belongs: c + r n, so that the pad touches its contact and lies outside [m]."""
    return add(get(state.contacts, finger), scale(hand.pad_radii[finger], get(state.normals, finger)))


@kernel
def attach_contacts(surface, hand, state):
    """(c, n) <- NN(f): every contact becomes the surface point nearest to its pad."""
    for finger in range(hand.finger_count):
        sample, point, normal = closest(surface, get(state.pads, finger), state.samples[finger])
        state.samples[finger] = sample
        put(state.contacts, finger, point)
        put(state.normals, finger, normal)


@kernel
def measure_pads(hand, state):
    """Residuals and pad angles of a state whose pose and contacts are up to date."""
    for finger in range(hand.finger_count):
        gap = subtract(pad_target(hand, state, finger), get(state.pads, finger))
        state.residuals[finger] = norm(gap)
        inward = scale(-1.0, get(state.normals, finger))
        state.pad_angles[finger] = angle_between(get(state.pad_normals, finger), inward)


@kernel
def evaluate(hand, settings, state):
    """Residuals, pad angles, Q and its parts of a state whose pose and contacts are up to date."""
    measure_pads(hand, state)
    state.object_quality = settings.object_weight * object_quality(state.contacts, hand.finger_count)
    state.hand_quality = settings.hand_weight * manipulability(hand, state.drivers)
    state.quality = state.object_quality + state.hand_quality
    state.merit = state.quality


@kernel
def measure_collision(problem, state, work, times):
    """Clearances, penetration and merit of an evaluated state; its time is added to the phase's ``times``."""
    started = seconds(work.clock)
    measure_clearances(problem.hand, state, problem.collision, problem.distance, work.rotation)
    _measure_surroundings(problem.scene, problem.hand, state, work)
    state.merit = state.quality - penalty(problem.hand, problem.settings, state)
    times.collision += seconds(work.clock) - started


@kernel
def _measure_surroundings(scene, hand, state, work):
    """Slacks of the links from obstacles; without a scene they stay infinite."""
    if scene is None:
        return
    measure_slacks(scene, hand, state, state.around, work.around, NEAR)
