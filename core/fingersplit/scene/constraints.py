"""All that a request may say beside the object and the hand: scene, approach, contact regions, task, end effector."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from fingersplit.errors import SceneError
from fingersplit.objects.model import ObjectModel
from fingersplit.scene.approach import Approach
from fingersplit.scene.contact_regions import ContactRegions
from fingersplit.scene.end_effector import EndEffector
from fingersplit.scene.entries import Document, Record, entry
from fingersplit.scene.task import Task
from fingersplit.scene.world import Scene

__all__ = ["Constraints"]


@dataclass(frozen=True)
class Constraints(Document):
    """What a grasp must keep to; with nothing given, only that a straight approach past the object is free."""

    scene: Scene = entry(Record(Scene), "The world around the object.", Scene())
    approach: Approach = entry(Record(Approach), "The way in and out.", Approach())
    contact_regions: ContactRegions = entry(
        Record(ContactRegions), "Where the fingers may touch the object.", ContactRegions()
    )
    task: Task = entry(Record(Task), "The loads to carry.", Task())
    end_effector: EndEffector = entry(Record(EndEffector), "What the hand is mounted on.", EndEffector())

    def resolved(self, load: Callable[[str], ObjectModel]) -> "Constraints":
        """The same with the models of all obstacles that name an object; ``load`` gives the model of an id."""
        obstacles = tuple(
            obstacle
            if obstacle.object_id is None or obstacle.model is not None
            else obstacle.with_model(load(obstacle.object_id))
            for obstacle in self.scene.obstacles
        )
        return replace(self, scene=replace(self.scene, obstacles=obstacles))

    def check(self) -> None:
        """Every frame that is named is known."""
        known = tuple(dict.fromkeys(("world", self.scene.frame, "object")))  # "world" always means the scene's frame
        for number, cone in enumerate(self.approach.directions or ()):
            _check_frame(f"approach.directions[{number}].frame", cone.frame, known)
        _check_frame("approach.retreat.frame", self.approach.retreat.frame, (*known, "palm"))
        for number, wrench in enumerate(self.task.wrenches):
            _check_frame(f"task.wrenches[{number}].frame", wrench.frame, known)


def _check_frame(field: str, name: str, known: tuple[str, ...]) -> None:
    if name not in known:
        raise SceneError(field, f"{name!r} is no known frame; known: {', '.join(known)}.")
