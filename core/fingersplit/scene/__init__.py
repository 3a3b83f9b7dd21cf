"""What a grasp must keep to beside the object: the world around it, ways in, contact regions, loads, the arm."""

from fingersplit.scene.approach import Approach, ApproachCone, Retreat
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.contact_regions import ContactRegions, Region
from fingersplit.scene.end_effector import AttachedBody, EndEffector, Reach
from fingersplit.scene.shapes import Pose, Primitive
from fingersplit.scene.task import Task, Wrench
from fingersplit.scene.world import Obstacle, Scene, SupportSurface, Workspace

__all__ = [
    "Approach",
    "ApproachCone",
    "AttachedBody",
    "Constraints",
    "ContactRegions",
    "EndEffector",
    "Obstacle",
    "Pose",
    "Primitive",
    "Reach",
    "Region",
    "Retreat",
    "Scene",
    "SupportSurface",
    "Task",
    "Workspace",
    "Wrench",
]
