"""Executions of a grasp in MuJoCo with the object elsewhere than planned: closing, then gravity and the lift.

The palm stands as planned; the object is displaced. The fingers go from the pre-grasp opening to the planned joints and
on to the squeeze targets, by the published servos; then the object is lifted, seen from the palm's accelerated frame.
What counts is how the object moves in the hand from the moment it is gripped.
"""

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.robustness.execution import Execution
from fingersplit.robustness.noise import Draws
from fingersplit.transforms import wxyz_from_rotation
from fingersplit.verification.motion_kernel import move_in_hand
from fingersplit.verification.protocol import REFERENCE_FRICTION
from fingersplit.verification.protocols.lift import Lift
from fingersplit.verification.scene import Scene

__all__ = ["Closing", "Executor"]

TIME_STEP = 0.004
"""[s]"""
CLOSE_TIME, PRESS_TIME, REST_TIME = 0.16, 0.12, 0.06
"""Of a closing: opened to the planned joints, on to the squeeze targets, coming to rest [s]."""
CHUNK = 5
"""Steps between two looks at a simulation."""
LOADED_TIME, DRIFT_TIME = 0.45, 0.1
"""Time under load after which a lift may be decided, and over which its drift is taken [s]."""
DRIFT_FACTOR = 2.0
"""A lift is decided where drifting on at so many times its rate would stay inside the limits."""
TORSIONAL_FRICTION = 0.005
"""[m]; of pads at a sliding friction of 0.6, in proportion at others, as in the executions that were fitted to."""
SCENES_KEPT = 4


@dataclass(frozen=True, eq=False)
class Closing:
    """How a closing ended.

    Attributes:
        forces: Force of each finger on the object, (F,) [N]; zero for one that does not touch.
        moved: How far the object's centre of mass was moved [m].
        turned: How far the object was turned [rad].
    """

    forces: NDArray[np.float64]
    moved: float
    turned: float


class Executor:
    """Executes grasps of one object by one hand; used by one thread at a time.

    Args:
        hand: The hand.
        model: The object.
        pieces: The same object as the simulation collides it.
        friction: Sliding friction that the grasps were planned for.
        mass: Of the object [kg].
    """

    def __init__(self, hand: Hand, model: ObjectModel, pieces: ConvexPieces, friction: float, mass: float) -> None:
        self._scene = _compiled(hand, pieces).copy()
        self._friction, self._mass = friction, mass
        self._center = np.array(model.center_of_mass)  # SciPy wants arrays that it could write to
        self._lift = Lift()
        self._drivers = list(hand.drivers)
        self._accelerations = _lift_accelerations(self._lift)
        self._scene.model.opt.timestep = TIME_STEP
        self._scene.set_object(mass, self._center, mass / model.mass * model.inertia)
        self._moments = self._scene.model.body_inertia[self._scene.object_body].copy()
        self._set_world(1.0, 1.0)

    def place(self, execution: Execution) -> None:
        """Put the hand where a grasp has it."""
        scene, pose = self._scene, execution.object_from_palm
        scene.model.body_pos[scene.palm_body] = pose[:3, 3]
        scene.model.body_quat[scene.palm_body] = wxyz_from_rotation(pose[:3, :3])
        scene.set_gains(scene.joint_controls, execution.stiffness, execution.damping)
        mujoco.mj_setConst(scene.model, scene.data)
        self._execution = execution

    def close(self, displacement: NDArray[np.float64], turn: NDArray[np.float64]) -> Closing:
        """Close the placed hand on the object, displaced (3,) [m] and turned about its centre of mass (3,) [rad]."""
        scene, data, execution = self._scene, self._scene.data, self._execution
        mujoco.mj_resetData(scene.model, data)
        scene.model.opt.gravity = 0.0
        rotation = Rotation.from_rotvec(turn)
        where = data.qpos[scene.object_qpos : scene.object_qpos + 7]
        where[:3] = self._center + displacement - rotation.apply(self._center)
        where[3:] = wxyz_from_rotation(rotation.as_matrix())
        data.qpos[scene.joint_qpos] = execution.opened
        opened, closed, pressed = (joints[self._drivers] for joints in execution[1:4])
        began = scene.object_pose()
        for first, last, duration in (
            (opened, closed, CLOSE_TIME),
            (closed, pressed, PRESS_TIME),
            (pressed, pressed, REST_TIME),
        ):
            chunks = max(1, round(duration / TIME_STEP / CHUNK))
            for share in np.arange(1, chunks + 1) / chunks:
                data.ctrl[scene.joint_controls] = first + share * (last - first)
                mujoco.mj_step(scene.model, data, nstep=CHUNK)
        return Closing(self._forces(), *self._moved_from(began))

    def holds(self, draws: Draws, which: int) -> bool:
        """Whether the placed grasp holds in one draw: every finger touches, also at the end, and the object stays."""
        self._set_world(float(draws.frictions[which]), float(draws.masses[which]))
        closing = self.close(draws.displacements[which], draws.turns[which])
        held = bool(closing.forces.all()) and self._carries() and bool(self._forces().all())
        self._set_world(1.0, 1.0)
        return held

    def _carries(self) -> bool:
        """Whether the object stays in the hand under gravity and in the lift, as `Lift` has its limits."""
        scene, data, lift = self._scene, self._scene.data, self._lift
        (trial,) = lift.trials
        scene.model.opt.gravity = trial.gravity
        end = sum(phase.duration for phase in trial.phases)
        masses = scene.model.body_mass[scene.moving_bodies][:, None]
        began, motions, window = scene.object_pose(), [(0.0, 0.0)], round(DRIFT_TIME / TIME_STEP / CHUNK)
        limits = lift.largest_displacement, lift.largest_rotation
        for number in range(round(end / TIME_STEP / CHUNK)):
            data.xfrc_applied[scene.moving_bodies, :3] = -masses * self._accelerations[number]
            mujoco.mj_step(scene.model, data, nstep=CHUNK)
            motions.append(self._moved_from(began))
            if motions[-1][0] > limits[0] or motions[-1][1] > limits[1]:
                return False
            time = (number + 1) * CHUNK * TIME_STEP
            if time >= LOADED_TIME:
                ahead = DRIFT_FACTOR * (end - time) / DRIFT_TIME
                drifting = zip(motions[-1], motions[-1 - window], limits, strict=True)
                if all(now + ahead * max(now - before, 0.0) <= limit for now, before, limit in drifting):
                    break
        return True

    def _set_world(self, friction: float, mass: float) -> None:
        """Friction and mass by factors of the planned ones.

        The axes of inertia stay: where they are not unique, others may come out, which the compiled model must not meet
        between two calls of ``mj_setConst``.
        """
        scene = self._scene
        scene.model.body_mass[scene.object_body] = mass * self._mass
        scene.model.body_inertia[scene.object_body] = mass * self._moments
        sliding = np.full(len(scene.hand.fingers), friction * self._friction)
        scene.set_friction(sliding, TORSIONAL_FRICTION * sliding / REFERENCE_FRICTION)

    def _moved_from(self, began: NDArray[np.float64]) -> tuple[float, float]:
        """How far the object's centre of mass is from where it was at a pose (7,) [m], and its turn since [rad]."""
        pose, (distance, turn) = self._scene.object_pose(), np.empty((2, 1))
        move_in_hand(began, pose[None, :3], pose[None, 3:], self._center, distance, turn)
        return float(distance[0]), float(turn[0])

    def _forces(self) -> NDArray[np.float64]:
        fingers = len(self._scene.hand.fingers)
        rows = self._scene.data.sensordata[: 7 * fingers].reshape(fingers, 7)
        return np.where(rows[:, 0] > 0, np.linalg.norm(rows[:, 1:4], axis=1), 0.0)


@lru_cache(maxsize=SCENES_KEPT)
def _compiled(hand: Hand, pieces: ConvexPieces) -> Scene:
    return Scene.build(hand, pieces)


def _lift_accelerations(lift: Lift) -> NDArray[np.float64]:
    """Accelerations of the palm in each chunk of a lift, (chunks, 3) [m/s^2]."""
    (trial,) = lift.trials
    paths: list[NDArray[np.float64]] = [np.zeros((2, 3))]
    offset = np.zeros(3)
    for phase in trial.phases:
        times = np.arange(1.0, round(phase.duration / TIME_STEP) + 1) * TIME_STEP
        paths.append(np.asarray(offset + phase.motion(times), np.float64))
        offset = paths[-1][-1]
    accelerations = np.diff(np.vstack(paths), 2, axis=0) / TIME_STEP**2
    chunks = len(accelerations) // CHUNK
    return np.asarray(accelerations[: chunks * CHUNK].reshape(chunks, CHUNK, 3).mean(axis=1))
