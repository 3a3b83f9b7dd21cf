"""Running a protocol: squeeze once, then every branch from there, all in MuJoCo's threaded rollout."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from mujoco.rollout import Rollout
from numpy.typing import NDArray

from fingersplit.contacts.grip import Grip
from fingersplit.verification.controllers import Controller
from fingersplit.verification.protocol import Branch, Phase
from fingersplit.verification.scene import Scene
from fingersplit.verification.scene_parts import CARRIAGE_FREQUENCY

__all__ = ["Recording", "open_fingers", "run_branches", "run_squeeze"]

CLEARANCE = 0.2e-3
"""Fingers open until their pads are this far from the pieces [m]."""
OPENING_STEPS = 12
_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
_CONTROL = mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_XFRC_APPLIED


@dataclass(frozen=True, eq=False)
class Recording:
    """What a stretch of simulation left, step by step.

    Attributes:
        times: Since the stretch began, (T,) [s].
        stable: Whether the simulation went through to the end.
        palm_offsets: How far the palm has moved, (T, 3) [m].
        joints: Joint angles, (T, N) [rad].
        object_positions: Origin of the object frame, (T, 3) [m].
        object_wxyz: Orientation of the object, (T, 4).
        touching: Whether each finger touches, (T, F).
        contact_forces: Force of each finger on the object, then of the palm, (T, F + 1, 3) [N].
        contact_positions: Where they act, (T, F + 1, 3) [m].
        penetrations: Deepest penetration of the hand into the object [m], (T,).
        torques: Joint torques, (T, N) [N m].
    """

    times: NDArray[np.float64]
    stable: bool
    palm_offsets: NDArray[np.float64]
    joints: NDArray[np.float64]
    object_positions: NDArray[np.float64]
    object_wxyz: NDArray[np.float64]
    touching: NDArray[np.bool_]
    contact_forces: NDArray[np.float64]
    contact_positions: NDArray[np.float64]
    penetrations: NDArray[np.float64]
    torques: NDArray[np.float64]


def open_fingers(scene: Scene, normals: NDArray[np.float64]) -> None:
    """Move each finger that lies inside the pieces out along its contact's normal, within its joints' range.

    Pieces stand up to a few millimetres off the mesh that a grasp was planned on; a hand would have stopped there.
    """
    hand, jacobians = scene.hand, scene.finger_jacobians()
    for _ in range(OPENING_STEPS):
        depths = scene.penetrations()[:-1]
        if depths.max() <= 0.0:
            return
        joints = scene.data.qpos[scene.joint_qpos].copy()
        for finger in np.flatnonzero(depths > 0.0):
            outwards = (depths[finger] + CLEARANCE) * normals[finger]
            joints += np.linalg.pinv(jacobians[finger], rcond=0.05) @ outwards
        scene.set_joints(np.clip(joints, hand.lower, hand.upper))


def run_squeeze(
    scene: Scene, controller: Controller, grip: Grip, duration: float, normals: NDArray[np.float64]
) -> Recording:
    """Close the hand on the free object, without gravity; the scene stands in the planned grasp, and ends squeezed."""
    steps = round(duration / scene.model.opt.timestep)
    controller.prepare(scene)
    ramp = np.clip(np.linspace(0.0, 1.5, steps), 0.0, 1.0)  # the last third lets it come to rest
    controls = controller.close(scene, grip, ramp)
    open_fingers(scene, normals)
    scene.model.opt.gravity = 0.0
    (recording,), states = _roll(scene, [scene.model], _with_forces(scene, controls)[None], 0)
    mujoco.mj_setState(scene.model, scene.data, states[0, -1], _STATE)
    scene.data.ctrl = controls[-1]
    mujoco.mj_forward(scene.model, scene.data)
    return recording


def run_branches(
    scene: Scene, controller: Controller, branches: tuple[Branch, ...], mass: float, threads: int
) -> list[Recording]:
    """Every branch from the squeezed grasp that the scene stands in, on up to ``threads`` threads."""
    held = controller.hold(scene, scene.data.ctrl.copy())
    models = []
    for branch in branches:
        model = scene.copy().model if branch is not branches[0] else scene.model
        model.opt.gravity = branch.gravity
        models.append(model)
    schedules = [_schedule(scene, held, branch.phases, mass) for branch in branches]
    longest = max(len(schedule) for schedule in schedules)
    padded = [np.pad(schedule, ((0, longest - len(schedule)), (0, 0)), mode="edge") for schedule in schedules]
    recordings, _ = _roll(scene, models, np.array(padded), threads if len(branches) > 1 else 0)
    return recordings


def _schedule(scene: Scene, held: NDArray[np.float64], phases: tuple[Phase, ...], mass: float) -> NDArray[np.float64]:
    """Controls and forces (T, n) of a branch."""
    step = scene.model.opt.timestep
    offset, parts = np.zeros(3), []
    for phase in phases:
        times = step * np.arange(1, round(phase.duration / step) + 1)
        controls = np.tile(held, (len(times), 1))
        path = offset + phase.motion(times)
        controls[:, scene.carriage_controls] = _feed_forward(path, step)
        parts.append(_with_forces(scene, controls, mass * np.asarray(phase.pull)))
        offset = path[-1]
    return np.vstack(parts)


def _feed_forward(path: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Controls that make the critically damped carriage follow a path (T, 3) without lag."""
    if len(path) < 3:
        return path
    velocity = np.gradient(path, step, axis=0)
    acceleration = np.gradient(velocity, step, axis=0)
    return np.asarray(path + 2 / CARRIAGE_FREQUENCY * velocity + acceleration / CARRIAGE_FREQUENCY**2)


def _with_forces(scene: Scene, controls: NDArray[np.float64], force: Any = 0.0) -> NDArray[np.float64]:
    """Controls (T, n_controls) followed by external wrenches (T, 6 n_bodies): ``force`` on the object, else zero."""
    wrenches = np.zeros((len(controls), scene.model.nbody, 6))
    wrenches[:, scene.object_body, :3] = force
    return np.hstack([controls, wrenches.reshape(len(controls), -1)])


def _roll(
    scene: Scene, models: list[Any], controls: NDArray[np.float64], threads: int
) -> tuple[list[Recording], NDArray[np.float64]]:
    """Simulate every row of ``controls`` (B, T, n) from the scene's state; recordings, and states (B, T, n_state)."""
    start = np.empty(mujoco.mj_stateSize(scene.model, _STATE))
    mujoco.mj_getState(scene.model, scene.data, start, _STATE)
    data = [mujoco.MjData(scene.model) for _ in range(max(1, threads))]
    with Rollout(nthread=threads if threads > 1 else 0) as rollout:
        states, sensors = rollout.rollout(models, data, start[None], controls, control_spec=_CONTROL, chunk_size=1)
    return [_recording(scene, start[0], *pair) for pair in zip(states, sensors, strict=True)], states


def _recording(scene: Scene, began: float, states: NDArray[np.float64], sensors: NDArray[np.float64]) -> Recording:
    model, fingers = scene.model, len(scene.grip_sites)
    times, positions = states[:, 0] - began, states[:, 1 : 1 + model.nq]
    expected = model.opt.timestep * np.arange(1, len(states) + 1)
    contacts = sensors[:, : 7 * (fingers + 1)].reshape(len(sensors), fingers + 1, 7)
    body = positions[:, scene.object_qpos : scene.object_qpos + 7]
    return Recording(
        times=expected,
        stable=bool(np.isfinite(states).all() and np.abs(times - expected).max() < 1e-6),
        palm_offsets=positions[:, model.jnt_qposadr[scene.carriage_joints]],
        joints=positions[:, scene.joint_qpos],
        object_positions=body[:, :3],
        object_wxyz=body[:, 3:],
        touching=contacts[:, :fingers, 0] > 0,
        contact_forces=contacts[:, :, 1:4],
        contact_positions=contacts[:, :, 4:7],
        penetrations=np.maximum(-sensors[:, 7 * (fingers + 1)], 0.0),
        torques=sensors[:, -len(scene.joint_qpos) :],
    )
