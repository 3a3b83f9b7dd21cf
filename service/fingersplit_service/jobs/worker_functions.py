"""What worker processes do, each function with what goes in and comes out; and how a worker is made warm.

The planner is imported inside the functions, so that only workers load it: the service process stays small
and starts fast. What goes in and comes out is plain and small; meshes and traces travel as files.
"""

import gc
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from fingersplit_client.schemas import ParallelGraspsGenerate
from fingersplit_service.jobs.dataset_shards import ShardTask, write_shard_of
from fingersplit_service.jobs.grasp_work import GraspFile, check_touching, generate_parallel_grasps, import_grasps
from fingersplit_service.jobs.hand_work import HandTask, HandUpload, add_hand, correct_hand, view_hand
from fingersplit_service.jobs.object_work import (
    Upload,
    ViewUpload,
    cut_view,
    decompose_object,
    export_mesh,
    inspect_object,
)
from fingersplit_service.jobs.outcome import JobOutcome
from fingersplit_service.jobs.planning import PlanTask, draw_starts, plan_job
from fingersplit_service.jobs.rendering import ExportedFile, RenderTask, convert_result, render_view
from fingersplit_service.jobs.verifying import VerifiedResult, VerifyTask, verify_first
from fingersplit_service.storage import Storage

__all__ = ["WarmUpReport", "WorkerFunctions", "warm"]


@dataclass(frozen=True)
class WarmUpReport:
    """What a warm worker knows.

    Attributes:
        hands: The documents of the hands.
        compiled: Whether it had to compile kernels.
        catalogs: What the planner's registries hold, documents by ``metrics``, ``formats`` and ``sources``.
    """

    hands: list[dict[str, Any]]
    compiled: bool = False
    catalogs: dict[str, list[dict[str, Any]]] = field(default_factory=dict)


def warm() -> WarmUpReport:
    """Load the planner and all hands, and plan once so that the kernels are compiled."""
    from fingersplit.cli.warming import compile_kernels
    from fingersplit.hands.hand import available_hands, load_hand

    hands = [load_hand(name) for name in available_hands()]
    compile_kernels(hands)
    gc.freeze()  # going through all that was loaded would take 0.2 s, in the middle of a job
    return WarmUpReport([hand.to_document() for hand in hands], _has_compiled(), _catalogs())


def _catalogs() -> dict[str, list[dict[str, Any]]]:
    from fingersplit.contacts.metrics import available_metrics
    from fingersplit.formats import available_formats
    from fingersplit.parallel_grasps.sources import available_sources
    from fingersplit.verification.controllers import available_controllers
    from fingersplit.verification.protocols import available_protocols

    sources = available_sources().values()
    return {
        "metrics": [metric.to_document() for metric in available_metrics().values()],
        "formats": [one.to_document() for one in available_formats().values()],
        "sources": [{"name": source.name, "meaning": source.meaning} for source in sources],
        "protocols": [protocol.info() for protocol in available_protocols().values()],
        "controllers": [controller.info() for controller in available_controllers().values()],
    }


def _has_compiled() -> bool:
    """Whether a kernel of the planner was not in the cache and had to be compiled in this process."""
    from numba.core.dispatcher import Dispatcher

    planner = [module for name, module in sys.modules.items() if name.startswith("fingersplit.")]
    kernels = [value for module in planner for value in vars(module).values() if isinstance(value, Dispatcher)]
    return any(kernel.stats.cache_misses for kernel in kernels)


@dataclass(frozen=True)
class WorkerFunctions:
    """The functions that workers run; a test may put others in their place."""

    warm: Callable[[], WarmUpReport] = warm
    inspect: Callable[[Storage, Upload], dict[str, Any]] = inspect_object
    cut_view: Callable[[Storage, ViewUpload], tuple[dict[str, Any], dict[str, Any]]] = cut_view
    decompose: Callable[[Storage, str], None] = decompose_object
    generate: Callable[[Storage, str, ParallelGraspsGenerate], list[dict[str, Any]]] = generate_parallel_grasps
    check_touching: Callable[[Storage, str, list[dict[str, Any]]], None] = check_touching
    import_grasps: Callable[[Storage, str, str, GraspFile], tuple[list[dict[str, Any]], str]] = import_grasps
    plan: Callable[[Storage, PlanTask], JobOutcome] = plan_job
    verify: Callable[[Storage, VerifyTask], VerifiedResult] = verify_first
    render: Callable[[Storage, RenderTask], None] = render_view
    draw_starts: Callable[[Storage, PlanTask], None] = draw_starts
    export: Callable[[Storage, str, str], None] = export_mesh
    write_shard: Callable[[Storage, ShardTask], None] = write_shard_of
    convert: Callable[[Storage, str, str, int | None], ExportedFile] = convert_result
    add_hand: Callable[[Storage, HandUpload], dict[str, Any]] = add_hand
    correct_hand: Callable[[Storage, str, str], dict[str, Any]] = correct_hand
    view_hand: Callable[[Storage, HandTask], None] = view_hand
