"""What workers run in place of the planner: a canned plan, and every way a job can go wrong.

The seed of a job says how it goes; the module is imported by worker processes too.
"""

import json
import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from fingersplit_service.findings import Finding
from fingersplit_service.jobs.planning import JobOrder, JobOutcome
from fingersplit_service.jobs.tasks import Tasks, Warmth, export_mesh, import_grasps, inspect_object
from fingersplit_service.jobs.views import ExportedFile, ViewOrder
from fingersplit_service.jobs.worker import report_progress
from fingersplit_service.storage import Storage

(
    FINE,
    DIES,
    DIES_ONCE,
    HANGS,
    HANGS_ONCE,
    RAISES,
    TOO_MUCH_MEMORY,
    WAITS,
    NO_GRASP,
    UNRECORDED,
    SHORT,
    DIES_RECORDING,
    RECORDED_LATE,
) = range(13)

HAND = {
    "name": "barrett",
    "title": "A hand",
    "fingers": [{"name": "finger1", "joints": ["finger1_base"], "pad_radius": 0.01}],
    "joints": [{"name": "finger1_base", "lower": 0.0, "upper": 2.4}],
}
PICTURE = b"\x89PNG\r\n\x1a\n"
_how: dict[str, int] = {}  # how the jobs go that are still to be recorded


def warm() -> Warmth:
    return Warmth([HAND])


def warm_and_tell() -> Warmth:
    """The niceness of the start in place of the hands."""
    return Warmth([{"niceness": os.getpriority(os.PRIO_PROCESS, threading.get_native_id())}])


def plan(storage: Storage, order: JobOrder) -> JobOutcome:
    asked = json.loads(order.request)
    report_progress("splitting", 0.5)
    _go(asked["seed"], storage.root / f"{order.job_id}.first", storage.root / "go")
    document = result_document(order.object_id, order.object_name, asked)
    finding = Finding(
        result=json.dumps(document),
        grasps=len(document["grasps"]),
        feasible=document["summary"]["feasible"],
        verified=0,
        holding_margin=document["grasps"][0]["metrics"]["holding_margin"],
    )
    _how[order.job_id] = asked["seed"]
    return JobOutcome(finding, document["timings_ms"], (True, False), 1, asked["recording"])


def record(storage: Storage, job_id: str) -> list[str]:
    how, traces = _how.pop(job_id), storage.traces(job_id)
    if how == UNRECORDED:
        return ["What pictures and recordings need could not be written: No space left on device."]
    if how == DIES_RECORDING:
        os.kill(os.getpid(), signal.SIGKILL)
    while how == RECORDED_LATE and not (storage.root / "go").exists():
        time.sleep(0.01)
    traces.parent.mkdir(parents=True, exist_ok=True)
    write_traces(traces, [(2, [0.1, 0, 0, 0], [0.0, 1e-3]), (0, [0.2, 0, 0, 0], [2e-3, 0.0])])
    return []


def write_traces(traces: Path, states: list[tuple[int, list[float], list[float]]]) -> None:
    """Traces of one grasp: phase, scores and residuals of each state."""
    about = {
        "hand": "barrett",
        "phase_names": ["cpo", "ppo", "map"],
        "grasps": {"1": {"title": "A grasp", "simulations": {}}},
    }
    trace = np.array(states, [("phases", int), ("scores", float, 4), ("residuals", float, 2)])
    texts = {"about": about, "result": {"grasps": [{"rank": 1}]}}
    coded = {name: np.frombuffer(json.dumps(text).encode(), dtype=np.uint8) for name, text in texts.items()}
    np.savez(traces, **coded, **{"1/trace": trace})


def generate(_storage: Storage, _object_id: str, asked: dict[str, Any]) -> list[dict[str, Any]]:
    z = 0.001 * asked["seed"]
    return [{"contacts": [[0.03, 0.0, z], [-0.03, 0.0, z]], "approach": [0, 0, -1]}] * asked["count"]


def _go(how: int, first: Path, go: Path) -> None:
    again = first.exists()
    first.touch()
    if how == DIES or (how == DIES_ONCE and not again):
        os.kill(os.getpid(), signal.SIGKILL)
    elif how == HANGS or (how == HANGS_ONCE and not again):
        max(range(10**15))  # in C, holding the interpreter's lock
    elif how == RAISES:
        raise RuntimeError("secret of the inside")
    elif how == TOO_MUCH_MEMORY:
        bytearray(10**15)
    elif how == WAITS:
        while not go.exists():
            time.sleep(0.01)
    elif how == SHORT:
        time.sleep(0.3)


def draw(storage: Storage, order: ViewOrder) -> None:
    with storage.atomic(storage.view(order.job_id, order.rank, order.name)) as staged:
        staged.write_bytes(PICTURE + bytes([order.rank]) if order.name == "picture.png" else order.name.encode())


def convert(result: str, format_name: str, rank: int | None) -> ExportedFile:
    assert json.loads(result)["grasps"]
    return ExportedFile(json.dumps({"format": format_name, "rank": rank}).encode(), ".json", "application/json")


def decompose(storage: Storage, object_id: str) -> None:
    """Say what runs where at which priority, and wait while there is a file ``hold``."""
    priority = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
    staged = storage.staged(".json")
    staged.write_text(json.dumps({"pid": os.getpid(), "priority": priority}))
    staged.replace(storage.root / f"{object_id}.decomposing")
    while (storage.root / "hold").exists():
        time.sleep(0.01)


TASKS = Tasks(
    warm=warm,
    inspect=inspect_object,
    decompose=decompose,
    generate=generate,
    import_grasps=import_grasps,
    plan=plan,
    record=record,
    draw=draw,
    export=export_mesh,
    convert=convert,
)


def result_document(object_id: str, object_name: str, asked: dict[str, Any]) -> dict[str, Any]:
    feasible = asked["seed"] != NO_GRASP
    contact = {
        "finger": "finger1",
        "position": [0.03, 0.0, 0.0],
        "normal": [1.0, 0.0, 0.0],
        "fingertip": [0.04, 0.0, 0.0],
        "residual": 0.0,
        "pad_angle": 0.1,
        "force": None,
    }
    state = {
        "palm": {"position": [0.0, 0.0, 0.2], "wxyz": [1.0, 0.0, 0.0, 0.0]},
        "joints": {"finger1_base": 1.0},
        "contacts": [contact],
    }
    stages = ("tangent_search", "projection_and_test", "collision")
    grasp = state | {
        "rank": 1,
        "feasible": feasible,
        "violations": [] if feasible else ["A pad leans too far."],
        "metrics": dict.fromkeys(
            (
                "holding_margin",
                "quality",
                "object_quality",
                "manipulability",
                "isotropy",
                "volume",
                "ferrari_canny",
            ),
            0.5,
        ),
        "termination": "converged" if feasible else "stopped_by_pad_angle",
        "advice": "Nothing to do.",
        "reason": "It is the only one.",
        "pregrasp": {"palm": state["palm"], "joints": state["joints"]},
        "squeeze_joints": {"finger1_base": 1.1},
        "iterations": {"outer": 1, "cpo": 2, "ppo": 3},
        "timings_ms": {f"{phase}_{stage}": 0.1 for phase in ("cpo", "ppo") for stage in stages} | {"total": 0.6},
        "initial": state
        | {
            "parallel_grasp": {"contacts": [[0.03, 0, 0], [-0.03, 0, 0]], "approach": [0, 0, -1]},
            "quality": 0.1,
        },
        "verification": None,
    }
    return {
        "hand": asked["hand"],
        "object": {
            "id": object_id,
            "name": object_name,
            "extents": [0.06, 0.06, 0.12],
            "volume": 4e-4,
            "mass": 0.2,
            "center_of_mass": [0.0, 0.0, 0.0],
            "samples": 30000,
            "sample_spacing": 0.001,
            "inertia": [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]],
            "seen": 1.0,
        },
        "seed": asked["seed"],
        "starts": asked["starts"],
        "summary": {
            "started": asked["starts"],
            "feasible": int(feasible),
            "terminations": {grasp["termination"]: 1},
            "message": f"{int(feasible)} of {asked['starts']} starts ended in a feasible grasp.",
        },
        "timings_ms": {"parallel_grasps": 1.0, "mapping": 1.0, "splitting": 1.0, "ranking": 1.0, "total": 4.0},
        "grasps": [grasp],
    }
