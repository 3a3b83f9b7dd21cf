"""What the tables keep of a result; without SQLAlchemy, as workers make it."""

from dataclasses import dataclass

__all__ = ["JobResultRow"]


@dataclass(frozen=True)
class JobResultRow:
    """What the tables keep of a result: the document, JSON, and the columns that lists show.

    Attributes:
        result: The result document.
        grasps: Number of ranked grasps.
        feasible: Number of feasible starts.
        verified: Number of grasps that held in simulation.
        holding_margin: Holding margin of rank 1 [N]; None without a grasp.
        warnings: What went wrong beside the result, in sentences.
    """

    result: str
    grasps: int
    feasible: int
    verified: int
    holding_margin: float | None
    warnings: tuple[str, ...] = ()
