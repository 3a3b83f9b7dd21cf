"""The grip of the virtual frame: the least that carries the loads of a protocol."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip import Grip, GripProblem, least_grip
from fingersplit.grasp import Grasp
from fingersplit.verification.controllers import VirtualFrame
from fingersplit.verification.protocol import Phase, Protocol
from fingersplit.verification.scene import Scene

__all__ = ["frame_grip"]


def frame_grip(
    scene: Scene, grasp: Grasp, protocol: Protocol, controller: VirtualFrame, mass: float, planned_friction: float
) -> Grip:
    """The least grip that carries the object through a protocol and keeps the fingers on it, heavy as they are."""
    loads, fastest = [np.zeros(3)], 0.0
    for trial in protocol.trials:
        for phase in trial.phases:
            steady = np.asarray(trial.gravity) + np.asarray(phase.pull)
            accelerations = _extreme_accelerations(phase)
            loads += [steady - acceleration for acceleration in accelerations]
            fastest = max(fastest, float(np.linalg.norm(accelerations, axis=1).max()))
    problem = GripProblem(
        contacts=grasp.contacts,
        normals=grasp.normals,
        jacobians=scene.finger_jacobians(),
        torque_limits=scene.hand.torque_ranges,
        center_of_mass=scene.model.body_ipos[scene.object_body],
        friction=controller.friction_margin * planned_friction,
        least_forces=controller.least_force + controller.load_margin * fastest * scene.finger_masses(),
        loads=controller.load_margin * mass * np.unique(np.round(loads, 6), axis=0),
    )
    return least_grip(problem)


def _extreme_accelerations(phase: Phase) -> list[NDArray[np.float64]]:
    """Largest palm accelerations of a phase both ways along each axis [m/s^2]; zero alone when it does not move."""
    times = np.linspace(0.0, phase.duration, 201)
    path = phase.motion(times)
    acceleration = np.gradient(np.gradient(path, times, axis=0), times, axis=0)
    extremes = [
        acceleration[row, axis] * np.eye(3)[axis]
        for axis in range(3)
        for row in (acceleration[:, axis].argmin(), acceleration[:, axis].argmax())
    ]
    return [extreme for extreme in extremes if np.abs(extreme).max() > 1e-6] or [np.zeros(3)]
