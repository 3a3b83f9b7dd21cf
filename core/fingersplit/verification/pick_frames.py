"""A camera for picks: what the world looked like about 100 times a second, with the forces of the fingers."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.transforms import rotation_from_wxyz, wxyz_from_rotation
from fingersplit.verification.frames import SimulationFrames
from fingersplit.verification.judging import FRAME_RATE
from fingersplit.verification.pick_world import PickWorld
from fingersplit.verification.picking import stretches
from fingersplit.verification.protocols.pick import Pick

__all__ = ["PickCamera"]


class PickCamera:
    """Looks at the world of a pick after every step, and keeps some of what it sees.

    Args:
        protocol: The pick that is run.
        world_from_object: Where the object stands before the pick, (4, 4).
        object_from_palm: Where the palm is in the grasp, (4, 4).
    """

    def __init__(
        self, protocol: Pick, world_from_object: NDArray[np.float64], object_from_palm: NDArray[np.float64]
    ) -> None:
        self._protocol = protocol
        self._rotation, self._position = world_from_object[:3, :3], world_from_object[:3, 3]
        self._palm = object_from_palm
        self._stride = max(1, round(1 / (FRAME_RATE * protocol.time_step)))
        self._steps = 0
        self._rows: list[tuple[NDArray[np.float64], ...]] = []

    def watch(self, world: PickWorld) -> None:
        """Take in what a step led to."""
        self._steps += 1
        if self._steps % self._stride == 0:
            position, wxyz = world.object_pose
            moved, joints = world.data.qpos[world.carriage_qpos], world.data.qpos[world.joint_qpos]
            self._rows.append((moved.copy(), joints.copy(), position, wxyz, *_finger_forces(world)))

    def frames(self) -> SimulationFrames:
        """What was kept, in the frame in which the object stood before the pick."""
        moved, joints, positions, turns, points, forces = (np.array(column) for column in zip(*self._rows, strict=True))
        steps = self._stride * np.arange(1, len(moved) + 1)
        names, counts = zip(*stretches(self._protocol), strict=True)
        back = self._rotation.T
        turned = np.array([wxyz_from_rotation(back @ rotation_from_wxyz(turn)) for turn in turns])
        return SimulationFrames(
            times=np.asarray(self._protocol.time_step * steps, np.float64),
            phases=np.searchsorted(np.cumsum(counts), steps),
            phase_names=names,
            palm_positions=self._palm[:3, 3] + moved @ self._rotation,
            palm_wxyz=np.tile(wxyz_from_rotation(self._palm[:3, :3]), (len(moved), 1)),
            joints=joints,
            object_positions=(positions - self._position) @ self._rotation,
            object_wxyz=turned,
            contact_positions=(points - self._position) @ self._rotation,
            contact_forces=forces @ self._rotation,
            closing=int(np.searchsorted(steps, sum(counts[: names.index("close")]), side="right")),
        )


def _finger_forces(world: PickWorld) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where each finger presses on the object, weighted by force, (F, 3) [m], and how hard, (F, 3) [N]."""
    fingers = len(world.hand.fingers)
    forces, places, weights = np.zeros((fingers, 3)), np.zeros((fingers, 3)), np.full(fingers, 1e-12)
    wrench = np.empty(6)
    for number, contact in enumerate(world.data.contact):
        first, second = contact.geom
        on_second = world.model.geom_bodyid[second] == world.object_body
        finger = world.finger_of_geom[first if on_second else second]
        if finger < 0 or not (on_second or world.model.geom_bodyid[first] == world.object_body):
            continue
        mujoco.mj_contactForce(world.model, world.data, number, wrench)
        force = contact.frame.reshape(3, 3).T @ wrench[:3]  # from the first geom on the second
        size = float(np.linalg.norm(force))
        forces[finger] += force if on_second else -force
        places[finger] += size * contact.pos
        weights[finger] += size
    return places / weights[:, None], forces
