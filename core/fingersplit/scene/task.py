"""What the grasp is for: the loads it must carry."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.scene.entries import Document, Record, entry
from fingersplit.scene.kinds import Choice, Several, Text, Vector

__all__ = ["Task", "Wrench"]

MAX_WRENCHES = 64


@dataclass(frozen=True)
class Wrench(Document):
    """A load on the object, beside its weight."""

    force: tuple[float, float, float] = entry(Vector((3,), "N", -1e4, 1e4), "Force on the object.", (0.0, 0.0, 0.0))
    torque: tuple[float, float, float] = entry(
        Vector((3,), "N m", -1e4, 1e4), "Torque on the object besides.", (0.0, 0.0, 0.0)
    )
    point: tuple[float, float, float] | None = entry(
        Vector(), "Where the force acts [m]; at the centre of mass when left out.", None
    )
    frame: str = entry(Text(), 'Frame of all three: the scene\'s, or "object".', "object")


@dataclass(frozen=True)
class Task(Document):
    """The loads that ``holding_margin`` is computed against."""

    wrenches: tuple[Wrench, ...] = entry(
        Several(Record(Wrench), MAX_WRENCHES),
        "Each is carried together with the weight, which is also carried alone.",
        (),
    )
    gravity: str = entry(
        Choice(("any", "scene")), "Gravity along any axis of the object, or as the scene has it.", "any"
    )

    def loads(
        self,
        mass: float,
        center: NDArray[np.float64],
        gravity: NDArray[np.float64],
        world_from_object: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Wrenches (n, 6) on the object about its centre of mass, object frame, force first [N, N m].

        For each direction of gravity the weight alone, then with each of the wrenches: it is also held without them.

        Args:
            mass: Of the object [kg].
            center: Its centre of mass, object frame (3,) [m].
            gravity: Scene frame (3,) [m/s^2].
            world_from_object: Pose of the object, (4, 4).
        """
        object_from_world = np.asarray(np.linalg.inv(world_from_object))
        downs = np.concatenate([np.eye(3), -np.eye(3)]) * np.linalg.norm(gravity)
        if self.gravity == "scene":
            downs = (object_from_world[:3, :3] @ gravity)[None]
        weights = np.hstack([mass * downs, np.zeros((len(downs), 3))])
        extra = [np.zeros(6), *(self._in_object(wrench, center, object_from_world) for wrench in self.wrenches)]
        return (weights[:, None] + np.array(extra)).reshape(-1, 6)

    @staticmethod
    def _in_object(
        wrench: Wrench, center: NDArray[np.float64], object_from_world: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        force, torque = np.array(wrench.force), np.array(wrench.torque)
        point = center if wrench.point is None else np.array(wrench.point)
        if wrench.frame != "object":
            rotation = object_from_world[:3, :3]
            force, torque = rotation @ force, rotation @ torque
            if wrench.point is not None:
                point = rotation @ point + object_from_world[:3, 3]
        return np.concatenate([force, torque + np.cross(point - center, force)])
