"""One object of a data set: rounds until it has as many grasps as wanted, or no more are found."""

from collections.abc import Callable
from pathlib import Path

from fingersplit.dataset.folder import DatasetFolder
from fingersplit.dataset.request import BARREN, MAX_ROUND, DatasetObject, DatasetRequest
from fingersplit.dataset.shards import selection, shard_path, write_shard
from fingersplit.errors import DatasetError, FingersplitError, ObjectFileError
from fingersplit.hands.hand import Hand
from fingersplit.result.plan import PlanResult

__all__ = ["ObjectRefusedError", "PlanRound", "fill_object"]

PlanRound = Callable[[int, int], PlanResult]
"""From the number of a round and the grasps that are missing to its result."""


class ObjectRefusedError(FingersplitError):
    """An object that nothing can be planned for.

    Attributes:
        code: Stable short name of the fault.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


def fill_object(
    folder: Path, request: DatasetRequest, item: DatasetObject, prepare: Callable[[], tuple[Hand, PlanRound]]
) -> None:
    """Plan round after round; every round is on disk before the next begins.

    Args:
        folder: The data set's folder.
        request: What it is to hold.
        item: The object.
        prepare: Gives the hand, and what plans a round.
    """
    kept = DatasetFolder(folder)
    heads = kept.heads(item)
    counts = [head.selected for head in heads]
    number = heads[-1].round + 1 if heads else 0
    try:
        hand, plan_round = prepare()
        message = ""
        while (have := sum(counts)) < request.per_object:
            if number >= request.max_rounds or (len(counts) >= BARREN and not any(counts[-BARREN:])):
                raise ObjectRefusedError(
                    "too_few_grasps", f"{have} of {request.per_object} grasps after {number} rounds. {message}".rstrip()
                )
            missing = min(request.per_object - have, MAX_ROUND)
            result = plan_round(number, missing)
            chosen = selection(result, request.verified, missing)
            path = shard_path(folder, item, number)
            write_shard(path, item, request, number, chosen, result, result.active_grip(hand))
            counts.append(int(chosen.sum()))
            number, message = number + 1, result.message
    except ObjectFileError as error:
        kept.fail(item, error.code, str(error))
    except ObjectRefusedError as error:
        kept.fail(item, error.code, str(error))
    except DatasetError:
        raise
    except FingersplitError as error:
        kept.fail(item, "refused", str(error))
