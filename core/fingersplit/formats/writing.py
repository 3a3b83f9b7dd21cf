"""From a result to the file of another tool, by the name of its format."""

from dataclasses import dataclass

from fingersplit.formats.containers import serialised
from fingersplit.formats.exporting import Export
from fingersplit.formats.registry import formats_that, known_format
from fingersplit.hands.hand import Hand, load_hand
from fingersplit.result.plan import PlanResult

__all__ = ["ExportedFile", "export", "export_file"]


@dataclass(frozen=True)
class ExportedFile:
    """A result as a file of another tool.

    Attributes:
        content: The file's bytes.
        suffix: Ending of such files.
        media_type: For HTTP.
        message: What went out and what was left out, in a sentence.
    """

    content: bytes
    suffix: str
    media_type: str
    message: str


def export_file(
    result: PlanResult,
    format: str,  # noqa: A002
    *,
    rank: int | None = None,
    hand: Hand | None = None,
) -> ExportedFile:
    """Write the grasps of a result that can be executed in another tool's format.

    Args:
        result: The result.
        format: Name of a format that can be written, see ``formats_that``.
        rank: Only this grasp, whatever is wrong with it; None for all that can be executed, best first (the best one
            where the format holds one grasp).
        hand: The hand that was planned for; None for the one that ships under the name in the result.

    Raises:
        FormatError: Unknown format, or no grasp that can be executed.
        ResultError: No such rank, or the hand is another one than was planned for.
        UnknownHandError: No hand ships under that name.
    """
    chosen = known_format(format, formats_that("write"))
    assert chosen.write is not None
    made = Export.of(result, hand or load_hand(result.hand), rank, 1 if chosen.one_grasp else None)
    content = serialised(chosen.container, chosen.write(made))
    return ExportedFile(content, chosen.suffix, chosen.media_type, f"{chosen.title}: {made.message}")


def export(
    result: PlanResult,
    format: str,  # noqa: A002
    *,
    rank: int | None = None,
    hand: Hand | None = None,
) -> bytes:
    """The bytes of ``export_file``."""
    return export_file(result, format, rank=rank, hand=hand).content
