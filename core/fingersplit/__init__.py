"""Grasp planning for multi-fingered hands by finger splitting: the public interface.

Example::

    import fingersplit as fs

    result = fs.plan(fs.load_object("mug.ply", unit="m"), fs.load_hand("barrett"))

A name loads what it needs when it is first used, so importing the package costs nothing. What is not listed here is
internal and may change without notice.
"""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fingersplit.contacts.metrics import available_metrics
    from fingersplit.errors import FingersplitError
    from fingersplit.formats import available_formats, export, import_parallel_grasps
    from fingersplit.hands import Hand, available_hands, load_hand
    from fingersplit.objects.cloud import PointCloud
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.objects.loading import load_object
    from fingersplit.objects.mesh import Mesh
    from fingersplit.objects.model import ObjectModel
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.objects.preparing import prepare_object
    from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
    from fingersplit.planning.planning import plan
    from fingersplit.recording.pictures import draw_picture
    from fingersplit.recording.replay import replay
    from fingersplit.recording.run_recording import write_recording
    from fingersplit.result import GraspResult, PlanResult, read_result, write_result
    from fingersplit.splitting.settings import PlannerSettings
    from fingersplit.verification import verify, verify_ranked
    from fingersplit.verification.protocols import available_protocols

__version__: str

_HOME = {
    "FingersplitError": "errors",
    "GraspResult": "result",
    "Hand": "hands",
    "Mesh": "objects.mesh",
    "ObjectModel": "objects.model",
    "ObjectOptions": "objects.options",
    "ParallelGrasp": "parallel_grasps.parallel_grasp",
    "PlanResult": "result",
    "PlannerSettings": "splitting.settings",
    "PointCloud": "objects.cloud",
    "available_formats": "formats",
    "available_hands": "hands",
    "available_metrics": "contacts.metrics",
    "available_protocols": "verification.protocols",
    "decompose": "objects.convex_pieces",
    "draw_picture": "recording.pictures",
    "export": "formats",
    "import_parallel_grasps": "formats",
    "load_hand": "hands",
    "load_object": "objects.loading",
    "plan": "planning.planning",
    "prepare_object": "objects.preparing",
    "read_result": "result",
    "replay": "recording.replay",
    "verify": "verification",
    "verify_ranked": "verification",
    "write_recording": "recording.run_recording",
    "write_result": "result",
}
"""Every public name and the module below this package that defines it."""

__all__ = [
    "FingersplitError",
    "GraspResult",
    "Hand",
    "Mesh",
    "ObjectModel",
    "ObjectOptions",
    "ParallelGrasp",
    "PlanResult",
    "PlannerSettings",
    "PointCloud",
    "__version__",
    "available_formats",
    "available_hands",
    "available_metrics",
    "available_protocols",
    "decompose",
    "draw_picture",
    "export",
    "import_parallel_grasps",
    "load_hand",
    "load_object",
    "plan",
    "prepare_object",
    "read_result",
    "replay",
    "verify",
    "verify_ranked",
    "write_recording",
    "write_result",
]


def __getattr__(name: str) -> Any:
    """Load a public name on its first use."""
    if name == "__version__":
        return version("fingersplit")
    if name not in _HOME:
        raise AttributeError(f"module 'fingersplit' has no attribute {name!r}; public names: {', '.join(__all__)}.")
    return getattr(import_module(f"fingersplit.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return list(__all__)
