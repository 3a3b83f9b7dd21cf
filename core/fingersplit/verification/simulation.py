"""Running a protocol: close once, then every trial from there, all in MuJoCo's threaded rollout."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import mujoco
import numpy as np
from mujoco.rollout import Rollout
from numpy.typing import NDArray

from fingersplit.verification.protocol import Trial
from fingersplit.verification.scene import Scene

__all__ = [
    "SimulationTrack",
    "keep_clear",
    "open_fingers",
    "palm_accelerations",
    "run_closing",
    "run_trials",
    "trial_loads",
]

CLEARANCE = 0.2e-3
"""Fingers open until their pads are this far from the pieces [m]."""
CLEARING_STEPS = 12
OPENING, OPENING_PARTS = 12e-3, 3
"""How far pads open that have no planned opening [m], and in how many steps."""
OPENING_DAMPING = 0.01
"""[m/rad]; a finger that cannot open does not swing."""
FREE_CHECK_INTERVAL = 0.015
"""How often a hand that closes freely is looked at whether it touches anything [s]."""
FIRST_CHECK = 0.15
"""Time after which a trial that may end early is first looked at, for an object that is falling [s]."""
CHECK_INTERVAL = 0.25
"""How often an undecided trial is looked at again [s]."""
_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
_CONTROL = mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_XFRC_APPLIED


@dataclass(frozen=True, eq=False)
class SimulationTrack:
    """A stretch of simulation, step by step, in the palm's frame of reference.

    Attributes:
        times: Since the stretch began, (T,) [s].
        stable: Whether the simulation went through to the end.
        start: Pose of the object when it began: position, quaternion (7,).
        palm_offsets: How far the palm has moved in the world, (T, 3) [m]; add it to positions for those in the world.
        joints: Joint angles, (T, N) [rad].
        object_positions: Origin of the object frame, (T, 3) [m].
        object_wxyz: Orientation of the object, (T, 4).
        touching: Whether each finger touches, (T, F).
        contact_forces: Force of each finger on the object, then of the palm, (T, F + 1, 3) [N].
        contact_positions: Where they act, (T, F + 1, 3) [m].
        penetrations: Deepest penetration of the hand into the object [m], (T,).
        torques: Torques at drivers, S^T of those at joints, (T, A) [N m].
    """

    times: NDArray[np.float64]
    stable: bool
    start: NDArray[np.float64]
    palm_offsets: NDArray[np.float64]
    joints: NDArray[np.float64]
    object_positions: NDArray[np.float64]
    object_wxyz: NDArray[np.float64]
    touching: NDArray[np.bool_]
    contact_forces: NDArray[np.float64]
    contact_positions: NDArray[np.float64]
    penetrations: NDArray[np.float64]
    torques: NDArray[np.float64]

    @classmethod
    def from_rollout(
        cls, scene: Scene, began: float, path: NDArray[np.float64], states: NDArray[Any], sensors: NDArray[Any]
    ) -> Self:
        """From what a rollout returned: states (T, n_state), sensors (T, n_sensor), with the palm's path (T, 3) [m]."""
        model, fingers = scene.model, len(scene.grip_sites)
        expected = model.opt.timestep * np.arange(1, len(states) + 1)
        positions = states[:, 1 : 1 + model.nq]
        contacts = sensors[:, : 7 * (fingers + 1)].reshape(len(sensors), fingers + 1, 7)
        body = positions[:, scene.object_qpos : scene.object_qpos + 7]
        on_time = np.abs(states[:, 0] - began - expected).max() < 1e-6
        return cls(
            times=expected,
            stable=bool(np.isfinite(states).all() and on_time),
            start=scene.object_pose(),
            palm_offsets=path[: len(states)],
            joints=positions[:, scene.joint_qpos],
            object_positions=body[:, :3],
            object_wxyz=body[:, 3:],
            touching=contacts[:, :fingers, 0] > 0,
            contact_forces=contacts[:, :, 1:4],
            contact_positions=contacts[:, :, 4:7],
            penetrations=np.maximum(-sensors[:, 7 * (fingers + 1)], 0.0),
            torques=sensors[:, -len(scene.joint_qpos) :] @ scene.coupling,
        )


def open_fingers(scene: Scene, normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joints (N,) with every pad about ``OPENING`` off its contact along the normal, within their range [rad].

    The scene stands in the grasp, and does so afterwards.
    """
    hand, closed = scene.hand, scene.data.qpos[scene.joint_qpos].copy()
    joints = closed.copy()
    for _ in range(OPENING_PARTS):
        for jacobian, normal in zip(scene.finger_jacobians(), normals, strict=True):
            along = normal @ jacobian  # (A,)
            step = OPENING / OPENING_PARTS / (along @ along + OPENING_DAMPING**2)
            joints += scene.coupling @ (step * along)
        joints = np.clip(joints, hand.lower, hand.upper)
        scene.set_joints(joints)
    scene.set_joints(closed)
    return np.asarray(joints)


def keep_clear(scene: Scene, normals: NDArray[np.float64]) -> None:
    """Move each finger that lies inside the pieces out along its contact's normal, within its joints' range.

    Pieces stand up to a few millimetres off the mesh that a grasp was planned on; a hand would have stopped there.
    """
    hand, jacobians = scene.hand, scene.finger_jacobians()
    for _ in range(CLEARING_STEPS):
        depths = scene.penetrations()[:-1]
        if depths.max() <= 0.0:
            return
        joints = scene.data.qpos[scene.joint_qpos].copy()
        for finger in np.flatnonzero(depths > 0.0):
            outwards = (depths[finger] + CLEARANCE) * normals[finger]
            joints += scene.coupling @ (np.linalg.pinv(jacobians[finger], rcond=0.05) @ outwards)
        scene.set_joints(np.clip(joints, hand.lower, hand.upper))


def run_closing(scene: Scene, controls: NDArray[np.float64], opened: int = 0) -> SimulationTrack:
    """Close the hand on the free object by ``controls`` (T, n_controls), without gravity; the scene ends closed.

    In the first ``opened`` steps the hand may not touch anything yet; as long as it does not, contacts are not looked
    for in every step, which is most of what a step costs.
    """
    scene.model.opt.gravity = 0.0
    start, still = _state(scene), np.zeros((len(controls), 3))
    rows = _with_forces(scene, controls, still, still)
    parts = [_roll_freely(scene, start, rows[:opened])] if opened and not scene.data.ncon else []
    last = np.vstack([start, *(part[0] for part in parts)])[-1:]
    states, sensors = _roll(scene, [scene.model], last, rows[None, sum(len(part[0]) for part in parts) :], 0)
    states, sensors = (np.concatenate(part) for part in zip(*parts, (states[0], sensors[0]), strict=True))
    track = SimulationTrack.from_rollout(scene, start[0], still, states, sensors)
    mujoco.mj_setState(scene.model, scene.data, states[-1], _STATE)
    scene.data.ctrl = controls[-1]
    mujoco.mj_forward(scene.model, scene.data)
    return track


def _roll_freely(
    scene: Scene, start: NDArray[np.float64], controls: NDArray[np.float64]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Simulate rows of ``controls`` (T, n) without contacts for as long as there are none: states, sensors (t, ...)."""
    model, data = scene.model, scene.data
    flags, interval, free = model.opt.disableflags, round(FREE_CHECK_INTERVAL / model.opt.timestep), 0
    model.opt.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    states, sensors = _roll(scene, [model], start[None], controls[None], 0)
    model.opt.disableflags = flags
    for end in range(interval, len(controls) + 1, interval):
        data.qpos = states[0, end - 1, 1 : 1 + model.nq]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        if data.ncon:
            break
        free = end
    return states[0, :free], sensors[0, :free]


def run_trials(
    scene: Scene,
    held: NDArray[np.float64],
    trials: tuple[Trial, ...],
    mass: float,
    decided_after: float | None,
    is_decided: Callable[[SimulationTrack, float], bool],
    threads: int,
) -> list[SimulationTrack]:
    """Every trial from the squeezed grasp that the scene stands in, on up to ``threads`` threads.

    Args:
        scene: The squeezed grasp.
        held: Controls that hold it, (n_controls,).
        trials: What is done.
        mass: Of the object [kg].
        decided_after: Time from which a trial may end before its last phase does [s]; None runs all to their ends.
        is_decided: Whether a trial may end, given its track so far and the time that is left [s].
        threads: Trials simulated at a time.
    """
    step = scene.model.opt.timestep
    models = [scene.model, *(scene.copy().model for _ in trials[1:])]
    paths, loads = [], []
    for model, trial in zip(models, trials, strict=True):
        model.opt.gravity = trial.gravity
        path, forces = trial_loads(trial, mass, step)
        paths.append(path)
        loads.append(np.stack([forces, palm_accelerations(path, step)]))
    longest = max(len(path) for path in paths)
    loads = [np.pad(load, ((0, 0), (0, longest - load.shape[1]), (0, 0)), mode="edge") for load in loads]
    start = _state(scene)
    parts: list[list[tuple[NDArray[Any], NDArray[Any]]]] = [[] for _ in trials]
    tracks: dict[int, SimulationTrack] = {}
    running = list(range(len(trials)))
    for begin, end in _stretches(longest, step, decided_after):
        starts = np.stack([parts[b][-1][0][-1] if parts[b] else start for b in running])
        controls = np.tile(held, (end - begin, 1))
        rows = np.stack([_with_forces(scene, controls, *loads[b][:, begin:end]) for b in running])
        states, sensors = _roll(scene, [models[b] for b in running], starts, rows, threads)
        for b, *part in zip(running, states, sensors, strict=True):
            parts[b].append((part[0], part[1]))
            joined = (np.concatenate([piece[k] for piece in parts[b]])[: len(paths[b])] for k in (0, 1))
            tracks[b] = SimulationTrack.from_rollout(scene, start[0], paths[b], *joined)
        running = [
            b for b in running if end < len(paths[b]) and not is_decided(tracks[b], (len(paths[b]) - end) * step)
        ]
        if not running:
            break
    return [tracks[b] for b in range(len(trials))]


def _stretches(steps: int, step: float, decided_after: float | None) -> list[tuple[int, int]]:
    """First and last step of every stretch after which trials are looked at."""
    if decided_after is None:
        return [(0, steps)]
    looks = [min(FIRST_CHECK, decided_after), *np.arange(0.0, steps * step, CHECK_INTERVAL), decided_after]
    numbers = {round(time / step) for time in looks if time >= decided_after or time == looks[0]} | {steps}
    ends = sorted(number for number in numbers if 0 < number <= steps)
    return list(zip([0, *ends[:-1]], ends, strict=True))


def trial_loads(trial: Trial, mass: float, step: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The palm's path (T, 3) [m] and the force (T, 3) [N] that pulls an object of ``mass`` [kg], every ``step`` [s]."""
    offset = np.zeros(3)
    paths, forces = [], []
    for phase in trial.phases:
        times = step * np.arange(1, round(phase.duration / step) + 1, dtype=np.float64)
        paths.append(offset + phase.motion(times))
        forces.append(np.tile(mass * np.asarray(phase.pull, np.float64), (len(times), 1)))
        offset = paths[-1][-1]
    return np.vstack(paths), np.vstack(forces)


def palm_accelerations(path: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Of a palm that begins and ends at rest, (T, 3) [m/s^2]."""
    padded = np.vstack([np.zeros((1, 3)), path, path[-1:]])
    return np.asarray(np.diff(padded, 2, axis=0) / step**2)


def _with_forces(
    scene: Scene,
    controls: NDArray[np.float64],
    forces: NDArray[np.float64],
    accelerations: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Controls (T, n_controls) followed by external wrenches (T, 6 n_bodies).

    ``forces`` (T, 3) [N] pull the object; every moving body feels its inertia against the palm's ``accelerations``
    (T, 3) [m/s^2].
    """
    wrenches = np.zeros((len(controls), scene.model.nbody, 6))
    masses = scene.model.body_mass[scene.moving_bodies]
    wrenches[:, scene.moving_bodies, :3] = -masses[:, None] * accelerations[:, None]
    wrenches[:, scene.object_body, :3] += forces
    return np.hstack([controls, wrenches.reshape(len(controls), -1)])


def _state(scene: Scene) -> NDArray[np.float64]:
    state = np.empty(mujoco.mj_stateSize(scene.model, _STATE))
    mujoco.mj_getState(scene.model, scene.data, state, _STATE)
    return state


def _roll(
    scene: Scene, models: list[Any], starts: NDArray[np.float64], controls: NDArray[np.float64], threads: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Simulate rows of ``controls`` (B, T, n) from ``starts`` (B, n_state): states and sensors, (B, T, ...)."""
    threads = min(threads, len(models)) if len(models) > 1 else 0
    data = scene.rollout_data(max(1, threads))
    rest = np.zeros((len(models), scene.model.nv))  # what a rollout before left in the data must not matter
    with Rollout(nthread=threads if threads > 1 else 0) as rollout:
        states, sensors = rollout.rollout(
            models, data, starts, controls, control_spec=_CONTROL, initial_warmstart=rest, chunk_size=1
        )
    return states, sensors
