"""What a stored result was planned for, from files: all that is said of the object comes from the result."""

from collections.abc import Callable, Sequence
from pathlib import Path

from fingersplit.errors import ObjectFileError, ResultError, SceneError
from fingersplit.hands.hand import Hand, load_hand
from fingersplit.objects.intake import read_file
from fingersplit.objects.loading import load_object
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.source import ObjectSource
from fingersplit.result.plan import PlanResult
from fingersplit.scene import Constraints

__all__ = ["known_obstacles", "load_origin", "obstacle_files"]

UNITS = ("m", "mm", "cm", "in")


def load_origin(result: PlanResult, file: Path, hand_source: str | None = None) -> tuple[ObjectModel, Hand]:
    """The object and the hand that a result was planned for: unit, scale, viewpoint and options are the result's.

    Args:
        result: The result.
        file: The object's file.
        hand_source: Name, folder or zip of the hand; None for the name in the result.

    Raises:
        ResultError: The file holds another object or none, or object or hand were altered.
        UnknownHandError: The hand is not known here.
    """
    planned, hand = result.object, load_hand(hand_source or result.hand)
    result.check_hand(hand)
    try:
        model = load_object(
            file,
            unit=planned.source.unit,
            scale=planned.source.scale,
            viewpoint=planned.source.viewpoint,
            support=planned.source.support,
            name=planned.name,
            options=planned.options,
        )
        result.check_object(model)
    except ResultError as error:
        raise ResultError(f"{file}: {error}") from error
    except ObjectFileError as error:
        raise ResultError(
            f"{file}, read as the result was planned (unit {planned.source.unit!r}), is not its object "
            f"{planned.name!r}: {error}"
        ) from error
    return model, result.active_grip(hand)


def obstacle_files(files: Sequence[Path]) -> Callable[[str], ObjectModel]:
    """What finds the obstacle of an id among files: by its hash, so that no other shape takes its place.

    The function raises ``SceneError`` where none of them is the obstacle.
    """

    def find(object_id: str) -> ObjectModel:
        for file in files:
            for unit in UNITS:  # results do not say in which unit the file of an obstacle is
                if _hash_of(file, unit) == object_id:
                    return load_object(file, unit=unit)
        raise SceneError(
            "scene.obstacles",
            f"name the object {object_id}, which is none of the given files "
            f"({', '.join(map(str, files)) or 'none'}); give its file with --obstacle.",
        )

    return find


def known_obstacles(constraints: Constraints) -> Callable[[str], ObjectModel]:
    """What finds the obstacle of an id among those that were just planned with."""
    models = (obstacle.model for obstacle in constraints.scene.obstacles)
    known = {model.id: model for model in models if model is not None}
    return lambda object_id: known[object_id]


def _hash_of(file: Path, unit: str) -> str | None:
    """Id of a file's shape with the default options; None where it is no object in this unit."""
    try:
        return read_file(file, ObjectSource(unit))[0].content_hash
    except ObjectFileError:
        return None
