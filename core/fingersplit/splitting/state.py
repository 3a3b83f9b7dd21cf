"""The state that finger splitting changes, and the work space of its kernels."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.hands.kernel import MAX_JOINTS, HandArrays, HandPose, empty_pose, move_fingers
from fingersplit.objects.grid import PointGrid
from fingersplit.objects.surface import Surface, closest
from fingersplit.quality.objective import manipulability, object_quality
from fingersplit.splitting.collision import penetration
from fingersplit.vectors import add, angle_between, get, norm, put, scale, subtract

__all__ = [
    "HAND_QUALITY",
    "OBJECT_QUALITY",
    "PENETRATION",
    "QUALITY",
    "GraspState",
    "Problem",
    "Work",
    "attach_contacts",
    "copy_state",
    "evaluate",
    "evaluate_quality",
    "measure_collision",
    "new_state",
    "new_work",
    "pad_target",
    "place_hand",
]

QUALITY, OBJECT_QUALITY, HAND_QUALITY, PENETRATION = 0, 1, 2, 3
"""Places in ``GraspState.scores``."""


class Problem(NamedTuple):
    """What stays the same over a run.

    Attributes:
        hand: The hand as arrays.
        surface: Surface samples of the object.
        collision: Sparser surface points for collision tests.
        center: Centre of mass in the object frame [m].
        settings: ``KernelSettings``.
    """

    hand: HandArrays
    surface: Surface
    collision: PointGrid
    center: tuple[float, float, float]
    settings: Any


class GraspState(NamedTuple):
    """A grasp in the object frame.

    Attributes:
        pose: Palm (R, t), joints q, and the links, pads and Jacobians that follow from them.
        contacts: Contact points c on the surface, (F, 3) [m].
        normals: Outward surface normals n at the contacts, (F, 3).
        samples: Surface sample nearest to each contact, (F,) int64.
        residuals: Distance of each fingertip f from its contact, (F,) [m].
        pad_angles: Angle between pad normal and inward surface normal, (F,) [rad].
        scores: Q, w1 Q_o, w2 Q_h and the deepest penetration [m], (4,).
    """

    pose: HandPose
    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    samples: NDArray[np.int64]
    residuals: NDArray[np.float64]
    pad_angles: NDArray[np.float64]
    scores: NDArray[np.float64]


class Work(NamedTuple):
    """Scratch arrays and the stop watch of one run.

    Attributes:
        rotations: For kinematics, (2, 3, 3).
        contact_gradient: w1 dQ_o/dc, (F, 3).
        joint_gradient: w2 dQ_h/dq, (N,).
        contact_step: Tangent step d_c of the contacts, (F, 3) [m].
        joint_step: Tangent step d_q of the joints, (N,) [rad].
        twist: Object body velocity V_po^b, linear then angular, (6,) [m/s, rad/s].
        matrix: System matrix, (3 F, 3 F).
        columns: Right-hand sides, (3 F, 2).
        frozen: Joints out of the active set, (N,) bool.
        limits: Lowest and highest step of a finger's joints, (2, MAX_JOINTS) [rad].
        steps: Steps of a finger's joints, (MAX_JOINTS,) [rad].
        clock: For ``seconds``, (2,) int64.
        times: Seconds in tangent search, projection and test, collision; first CPO then PPO, (6,) [s].
    """

    rotations: NDArray[np.float64]
    contact_gradient: NDArray[np.float64]
    joint_gradient: NDArray[np.float64]
    contact_step: NDArray[np.float64]
    joint_step: NDArray[np.float64]
    twist: NDArray[np.float64]
    matrix: NDArray[np.float64]
    columns: NDArray[np.float64]
    frozen: NDArray[np.bool_]
    limits: NDArray[np.float64]
    steps: NDArray[np.float64]
    clock: NDArray[np.int64]
    times: NDArray[np.float64]


@kernel
def new_state(hand):
    """A state with everything unset but a valid palm pose."""
    fingers = hand.joint_counts.size
    return GraspState(
        empty_pose(hand),
        np.zeros((fingers, 3)),
        np.zeros((fingers, 3)),
        np.full(fingers, -1, np.int64),
        np.zeros(fingers),
        np.zeros(fingers),
        np.zeros(4),
    )


@kernel
def new_work(hand):
    """Scratch arrays for a hand."""
    fingers, joints = hand.joint_counts.size, hand.lower.size
    size = max(3 * fingers, MAX_JOINTS)
    return Work(
        np.zeros((2, 3, 3)),
        np.zeros((fingers, 3)),
        np.zeros(joints),
        np.zeros((fingers, 3)),
        np.zeros(joints),
        np.zeros(6),
        np.zeros((size, size)),
        np.zeros((size, 2)),
        np.zeros(max(joints, MAX_JOINTS), np.bool_),
        np.zeros((2, MAX_JOINTS)),
        np.zeros(MAX_JOINTS),
        np.zeros(2, np.int64),
        np.zeros(6),
    )


@kernel
def copy_state(target, source):
    """Overwrite ``target`` with ``source``."""
    target.pose.palm_rotation[:] = source.pose.palm_rotation
    target.pose.palm_position[:] = source.pose.palm_position
    target.pose.joints[:] = source.pose.joints
    target.pose.link_rotations[:] = source.pose.link_rotations
    target.pose.link_positions[:] = source.pose.link_positions
    target.pose.pads[:] = source.pose.pads
    target.pose.pad_normals[:] = source.pose.pad_normals
    target.pose.jacobians[:] = source.pose.jacobians
    target.contacts[:] = source.contacts
    target.normals[:] = source.normals
    target.samples[:] = source.samples
    target.residuals[:] = source.residuals
    target.pad_angles[:] = source.pad_angles
    target.scores[:] = source.scores


@kernel
def pad_target(hand, state, finger):
    """Where the pad's centre belongs: c + r n, so that the pad touches its contact and lies outside [m]."""
    return add(get(state.contacts, finger), scale(hand.pad_radii[finger], get(state.normals, finger)))


@kernel
def attach_contacts(problem, state):
    """(c, n) <- NN(f): every contact becomes the surface point nearest to its pad."""
    for finger in range(len(state.contacts)):
        sample, point, normal = closest(problem.surface, get(state.pose.pads, finger), state.samples[finger])
        state.samples[finger] = sample
        put(state.contacts, finger, point)
        put(state.normals, finger, normal)


@kernel
def evaluate(problem, state):
    """Residuals, pad angles and Q of a state whose pose and contacts are up to date."""
    for finger in range(len(state.contacts)):
        gap = subtract(pad_target(problem.hand, state, finger), get(state.pose.pads, finger))
        state.residuals[finger] = norm(gap)
        inward = scale(-1.0, get(state.normals, finger))
        state.pad_angles[finger] = angle_between(get(state.pose.pad_normals, finger), inward)
    evaluate_quality(problem, state)


@kernel
def evaluate_quality(problem, state):
    """Q and its parts from contacts and joints."""
    hand, settings = problem.hand, problem.settings
    state.scores[OBJECT_QUALITY] = settings.object_weight * object_quality(state.contacts)
    state.scores[HAND_QUALITY] = settings.hand_weight * manipulability(hand, state.pose.joints)
    state.scores[QUALITY] = state.scores[OBJECT_QUALITY] + state.scores[HAND_QUALITY]


@kernel
def measure_collision(problem, state):
    """Deepest penetration of a state whose pose is up to date."""
    state.scores[PENETRATION] = penetration(problem.hand, state.pose, problem.collision)


@kernel
def place_hand(problem, state, work):
    """Kinematics of a state whose palm and joints are set."""
    move_fingers(problem.hand, state.pose, work.rotations)
