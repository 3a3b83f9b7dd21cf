"""A whole pick in MuJoCo: approach, closing, lift and hold, with the table and the obstacles there and gravity on.

The object rests on its support. The hand comes along the planned approach, closes by position servos with torque limits
from the planned opening to the planned grasp and on into the planned grip, leaves along the retreat, and holds.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.scene.preparing import PreparedScene
from fingersplit.transforms import rotation_from_wxyz
from fingersplit.verification.pick_world import CARRIAGE_FREQUENCY, PickWorld
from fingersplit.verification.protocols.pick import Pick

__all__ = ["PickMotion", "PickReport", "PickWays", "run_pick", "stretches"]

PickReason = Literal[
    "held",
    "not_at_rest",
    "obstacle_touched",
    "object_pushed",
    "slipped",
    "rotated",
    "contact_lost",
    "unstable_simulation",
]
_Stretch = tuple[NDArray[np.float64], NDArray[np.float64]]
AT_REST = 5e-3
"""[m]; an object that moves farther while it settles does not rest as the scene says."""


@dataclass(frozen=True, eq=False)
class PickWays:
    """How a grasp is reached and left, object frame.

    Attributes:
        approach: Unit direction of travel towards the grasp, (3,).
        approach_distance: How far before the grasp the way begins [m].
        opened: Joints of the approach, (N,) [rad].
        retreat: Unit direction in which hand and object leave, (3,).
        retreat_distance: How far [m].
    """

    approach: NDArray[np.float64]
    approach_distance: float
    opened: NDArray[np.float64]
    retreat: NDArray[np.float64]
    retreat_distance: float

    def seen_from(self, object_moved: NDArray[np.float64]) -> "PickWays":
        """The same ways of the hand, in the frame of an object that stands at a pose (4, 4) of its planned frame."""
        turn = object_moved[:3, :3].T
        return replace(self, approach=turn @ self.approach, retreat=turn @ self.retreat)


@dataclass(frozen=True, eq=False)
class PickMotion:
    """What the hand does.

    Attributes:
        ways: How the grasp is reached and left.
        closed: Joints of the grasp, (N,) [rad].
        pressed: Servo targets of the grip, (N,) [rad].
    """

    ways: PickWays
    closed: NDArray[np.float64]
    pressed: NDArray[np.float64]


@dataclass(frozen=True)
class PickReport:
    """What a pick showed.

    Attributes:
        reason: Why it passed or not.
        settling: How far the object moved before the hand came [m].
        first_touches: When each finger first touched the object, since the approach began [s]; None for never.
        pushed: How far the object had moved when the last finger touched it [m].
        touched: Names of obstacles and supports that the hand touched and may not.
        displacement: Farthest that the object moved in the hand from the grip on [m].
        rotation: Most that it turned in it [rad].
        lifted: How far the object went along the retreat [m].
        lost_contacts: Fingers that did not touch at the end.
        times: Time of each frame, (T,) [s].
        palm_positions: Palm's origin, scene frame, (T, 3) [m].
        joints: Joint angles, (T, N) [rad].
        object_positions: Origin of the object frame, (T, 3) [m].
        object_wxyz: Its orientation, (T, 4).
    """

    reason: PickReason
    settling: float
    first_touches: tuple[float | None, ...]
    pushed: float
    touched: tuple[str, ...]
    displacement: float
    rotation: float
    lifted: float
    lost_contacts: tuple[str, ...]
    times: NDArray[np.float64]
    palm_positions: NDArray[np.float64]
    joints: NDArray[np.float64]
    object_positions: NDArray[np.float64]
    object_wxyz: NDArray[np.float64]


@dataclass(eq=False)
class _Log:
    """What is written down at every step: object, palm, joints, contacts."""

    object_positions: list[NDArray[np.float64]]
    object_wxyz: list[NDArray[np.float64]]
    palm_positions: list[NDArray[np.float64]]
    joints: list[NDArray[np.float64]]
    touching: list[NDArray[np.bool_]]
    obstacles: set[int]


def run_pick(
    world: PickWorld,
    motion: PickMotion,
    scene: PreparedScene,
    protocol: Pick,
    watch: Callable[[PickWorld], None] | None = None,
) -> PickReport:
    """Run a pick; the world's carriage is at zero in the grasp.

    Args:
        world: From ``PickWorld.build``, its object and friction set.
        motion: What the hand does.
        scene: The object's pose and names of obstacles.
        protocol: Times and bounds.
        watch: Is shown the world after every step.
    """
    rotation = scene.world_from_object[:3, :3]
    ways, opened = motion.ways, motion.ways.opened
    back, away = -ways.approach_distance * (rotation @ ways.approach), rotation @ ways.retreat
    step = protocol.time_step
    world.model.opt.timestep = step
    world.place(scene.world_from_object, opened)
    world.data.qpos[world.carriage_qpos] = back
    mujoco.mj_forward(world.model, world.data)
    up = -np.array(scene.constraints.scene.gravity)
    world.raise_object(up / max(float(np.linalg.norm(up)), 1e-9))
    log = _Log([], [], [], [], [], set())
    start = _center(world)
    still, leave = np.zeros(3), ways.retreat_distance * away
    motions: dict[str, tuple[_Stretch, _Stretch]] = {
        "settle": ((back, back), (opened, opened)),
        "approach": ((back, still), (opened, opened)),
        "close": ((still, still), (opened, motion.closed)),
        "squeeze": ((still, still), (motion.closed, motion.pressed)),
        "rest": ((still, still), (motion.pressed, motion.pressed)),
        "lift": ((still, leave), (motion.pressed, motion.pressed)),
        "hold": ((leave, leave), (motion.pressed, motion.pressed)),
    }
    settling, came, gripped = 0.0, 0, 0
    for name, steps in stretches(protocol):
        palm, joints = motions[name]
        shares = _smooth(np.arange(1, steps + 1) / steps)[:, None]
        path = palm[0] + shares * (palm[1] - palm[0])
        targets = joints[0] + shares * (joints[1] - joints[0])
        _play(world, _feed_forward(path, step), targets, log, watch)
        if name == "settle":
            settling, came = float(np.linalg.norm(_center(world) - start)), len(log.touching)
        elif name == "rest":
            gripped = len(log.touching)
    return _judge(world, scene, protocol, log, (came, gripped), settling, away, step)


def stretches(protocol: Pick) -> list[tuple[str, int]]:
    """The phases of a pick in their order, with the steps that each takes; ``rest`` lets the grip come to rest."""
    times = {
        "settle": protocol.settle_time,
        "approach": protocol.approach_time,
        "close": protocol.close_time,
        "squeeze": protocol.squeeze_time,
        "rest": protocol.squeeze_time / 2,
        "lift": protocol.lift_time,
        "hold": protocol.hold_time,
    }
    return [(name, max(2, round(time / protocol.time_step))) for name, time in times.items()]


def _center(world: PickWorld) -> NDArray[np.float64]:
    """The object's centre of mass, scene frame (3,) [m]; its origin may be far away, and then moves by every turn."""
    position, wxyz = world.object_pose
    return np.asarray(position + rotation_from_wxyz(wxyz) @ world.model.body_ipos[world.object_body])


def _play(
    world: PickWorld,
    path: NDArray[np.float64],
    targets: NDArray[np.float64],
    log: _Log,
    watch: Callable[[PickWorld], None] | None,
) -> None:
    data = world.data
    for place, joints in zip(path, targets, strict=True):
        data.ctrl[world.carriage_controls], data.ctrl[world.joint_controls] = place, joints[world.drivers]
        mujoco.mj_step(world.model, data)
        position, wxyz = world.object_pose
        touching, obstacle = world.touching()
        log.object_positions.append(position)
        log.object_wxyz.append(wxyz)
        log.palm_positions.append(data.qpos[world.carriage_qpos].copy())
        log.joints.append(data.qpos[world.joint_qpos].copy())
        log.touching.append(touching)
        if obstacle is not None:
            log.obstacles.add(obstacle)
        if watch is not None:
            watch(world)


def _smooth(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """The curve of least jerk from 0 to 1."""
    return np.asarray(shares**3 * (10 - 15 * shares + 6 * shares**2))


def _feed_forward(path: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Controls that make the critically damped carriage follow a path (T, 3) without lag."""
    velocity = np.gradient(path, step, axis=0)
    acceleration = np.gradient(velocity, step, axis=0)
    return np.asarray(path + 2 / CARRIAGE_FREQUENCY * velocity + acceleration / CARRIAGE_FREQUENCY**2)


def _judge(
    world: PickWorld,
    scene: PreparedScene,
    protocol: Pick,
    log: _Log,
    marks: tuple[int, int],
    settling: float,
    away: NDArray[np.float64],
    step: float,
) -> PickReport:
    came, gripped = marks
    places, turns = np.array(log.object_positions), np.array(log.object_wxyz)
    palms, touching = np.array(log.palm_positions), np.array(log.touching)
    firsts = [int(rows.argmax()) if rows.any() else None for rows in touching[came:].T]
    last = came + max(first if first is not None else gripped - came for first in firsts)
    center = world.model.body_ipos[world.object_body]
    centers = places + np.array([rotation_from_wxyz(turn) @ center for turn in turns])
    before = centers[max(came - 1, 0)]
    pushed = float(np.linalg.norm(centers[came : last + 1] - before, axis=1).max())
    in_hand = centers[gripped:] - palms[gripped:]
    displacement = float(np.linalg.norm(in_hand - (centers[gripped - 1] - palms[gripped - 1]), axis=1).max())
    cosines = np.abs(turns[gripped:] @ turns[gripped - 1])
    rotation = float(2.0 * np.arccos(np.clip(cosines, 0.0, 1.0)).max())
    lifted = float((centers[-1] - centers[gripped - 1]) @ away)
    settled_rows = touching[-max(1, round(0.1 / step)) :]
    lost = tuple(
        finger.name for finger, held in zip(world.hand.fingers, list(settled_rows.T), strict=True) if not held.any()
    )
    reason: PickReason = "held"
    if not np.isfinite(places).all():
        reason = "unstable_simulation"
    elif settling > AT_REST:
        reason = "not_at_rest"
    elif log.obstacles:
        reason = "obstacle_touched"
    elif pushed > protocol.largest_push:
        reason = "object_pushed"
    elif displacement > protocol.largest_displacement:
        reason = "slipped"
    elif rotation > protocol.largest_rotation:
        reason = "rotated"
    elif protocol.all_contacts and lost:
        reason = "contact_lost"
    return PickReport(
        reason=reason,
        settling=settling,
        first_touches=tuple(None if first is None else first * step for first in firsts),
        pushed=pushed,
        touched=tuple(scene.names[number] for number in sorted(log.obstacles)),
        displacement=displacement,
        rotation=rotation,
        lifted=lifted,
        lost_contacts=lost,
        times=np.asarray(step * np.arange(1.0, len(places) + 1)),
        palm_positions=palms,
        joints=np.array(log.joints),
        object_positions=places,
        object_wxyz=turns,
    )
