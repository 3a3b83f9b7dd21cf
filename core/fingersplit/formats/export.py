"""From a result to the file of another tool: one line a format."""

from collections.abc import Callable
from dataclasses import dataclass

from fingersplit.errors import ExchangeError
from fingersplit.formats.dexgraspbench import write_dexgraspbench
from fingersplit.formats.dexgraspnet import write_dexgraspnet
from fingersplit.formats.isaac_grasp import write_isaac_grasp
from fingersplit.formats.moveit import write_moveit_json, write_moveit_yaml
from fingersplit.formats.multi_gripper_grasp import write_multi_gripper_grasp
from fingersplit.formats.results import Results
from fingersplit.result.plan import PlanResult

__all__ = ["EXPORT_FORMATS", "ExportFormat", "export"]


@dataclass(frozen=True)
class ExportFormat:
    """A format that grasps can be written in.

    Attributes:
        title: What it is, for people.
        suffix: Ending of its files.
        media_type: For HTTP.
        write: From results to the file's bytes.
    """

    title: str
    suffix: str
    media_type: str
    write: Callable[[Results], bytes]


_BYTES, _JSON, _YAML = "application/octet-stream", "application/json", "application/yaml"

EXPORT_FORMATS: dict[str, ExportFormat] = {
    "isaac_grasp": ExportFormat("Isaac grasp file", ".yaml", _YAML, write_isaac_grasp),
    "moveit": ExportFormat("moveit_msgs/Grasp messages, JSON", ".json", _JSON, write_moveit_json),
    "moveit_yaml": ExportFormat("moveit_msgs/Grasp messages, YAML", ".yaml", _YAML, write_moveit_yaml),
    "dexgraspbench": ExportFormat("DexGraspBench sample, one grasp", ".npy", _BYTES, write_dexgraspbench),
    "multi_gripper_grasp": ExportFormat("MultiGripperGrasp", ".json", _JSON, write_multi_gripper_grasp),
    "dexgraspnet": ExportFormat("DexGraspNet", ".npy", _BYTES, write_dexgraspnet),
}


def export(result: PlanResult, format: str, *, rank: int | None = None) -> bytes:  # noqa: A002
    """Write the feasible grasps of a result in another tool's format.

    Args:
        result: The result.
        format: A key of ``EXPORT_FORMATS``.
        rank: Only this grasp, feasible or not; None for all feasible ones, best first (the best one where the format
            holds one grasp).

    Raises:
        ExchangeError: Unknown format, or no grasp that is feasible.
        ResultError: No such rank.
    """
    if format not in EXPORT_FORMATS:
        raise ExchangeError(f"Unknown export format {format!r}; known: {', '.join(EXPORT_FORMATS)}.")
    return EXPORT_FORMATS[format].write(Results.from_result(result, rank))
