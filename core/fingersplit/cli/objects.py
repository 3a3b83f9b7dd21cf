"""What a stored result was planned for, from the object's file: all that is said of it comes from the result."""

from pathlib import Path

from fingersplit.errors import ResultError
from fingersplit.hands.hand import Hand, load_hand
from fingersplit.objects.loading import load_object
from fingersplit.objects.model import ObjectModel
from fingersplit.result.plan import PlanResult

__all__ = ["load_origin"]


def load_origin(result: PlanResult, file: Path, hand_source: str | None = None) -> tuple[ObjectModel, Hand]:
    """The object and the hand that a result was planned for: unit, scale, viewpoint and options are the result's.

    Args:
        result: The result.
        file: The object's file.
        hand_source: Name, folder or zip of the hand; None for the name in the result.

    Raises:
        ResultError: The file holds another object, or object or hand were altered.
        ObjectFileError: The file, or what it holds, is no graspable object.
        UnknownHandError: The hand is not known here.
    """
    planned, hand = result.object, result.active_grip(load_hand(hand_source or result.hand))
    model = load_object(
        file,
        unit=planned.source.unit,
        scale=planned.source.scale,
        viewpoint=planned.source.viewpoint,
        name=planned.name,
        options=planned.options,
    )
    try:
        result.check_origin(model, hand)
    except ResultError as error:
        raise ResultError(f"{file}: {error}") from error
    return model, hand
