"""What workers run in place of the planner: a canned plan, and every way a job can go wrong.

The hand that a job names says how it goes; the module is imported by worker processes too.
"""

import gzip
import hashlib
import json
import os
import shutil
import signal
import tempfile
import threading
import time
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from fingersplit.errors import FormatError, HandError
from fingersplit_client.schemas import JobCreate, ParallelGraspsGenerate, Verification
from fingersplit_service.database.result_row import JobResultRow
from fingersplit_service.jobs.dataset_shards import SHARD, ShardTask
from fingersplit_service.jobs.grasp_work import import_grasps
from fingersplit_service.jobs.hand_work import HandTask, HandUpload
from fingersplit_service.jobs.object_work import Upload, export_mesh, inspect_object
from fingersplit_service.jobs.outcome import JobOutcome
from fingersplit_service.jobs.planning import STARTS, PlanTask
from fingersplit_service.jobs.rendering import ExportedFile, RenderTask
from fingersplit_service.jobs.verifying import VerifiedResult, VerifyTask
from fingersplit_service.jobs.worker import report_progress
from fingersplit_service.jobs.worker_functions import WarmUpReport, WorkerFunctions
from fingersplit_service.storage import Storage
from plan_documents import filled

FINE = "barrett"
DIES, DIES_ONCE, HANGS, HANGS_ONCE = "dies", "dies_once", "hangs", "hangs_once"
RAISES, TOO_MUCH_MEMORY, WAITS, NO_GRASP = "raises", "too_much_memory", "waits", "no_grasp"
HOWS = (FINE, DIES, DIES_ONCE, HANGS, HANGS_ONCE, RAISES, TOO_MUCH_MEMORY, WAITS, NO_GRASP)

HAND = {
    "title": "A hand",
    "fingers": [{"name": "finger1", "joints": ["finger1_base"], "pad_radius": 0.01}],
    "joints": [{"name": "finger1_base", "lower": 0.0, "upper": 2.4}],
}
CATALOGS = {
    "metrics": [
        {
            "name": "holding_margin",
            "title": "margin",
            "unit": "N",
            "meaning": "A metric.",
            "higher_is_better": True,
            "source": "Kerr1986",
            "in_tables": True,
        }
    ],
    "formats": [
        {
            "name": "moveit",
            "title": "MoveIt",
            "suffix": ".json",
            "media_type": "application/json",
            "reads_parallel_grasps": False,
            "reads_hand_grasps": False,
            "writes": True,
            "one_grasp": False,
        }
    ],
    "protocols": [
        {"name": name, "meaning": "A test.", "numbers": {}} for name in ("lift", "pick", "shake", "six_direction")
    ],
    "controllers": [
        {"name": name, "meaning": "A controller.", "numbers": {}} for name in ("position_servo", "virtual_frame")
    ],
    "sources": [{"name": name, "meaning": "A source."} for name in ("antipodal", "both", "surface_fitting")],
}
CUBE = b"OFF\n8 12 0\n0 0 0\n5 0 0\n"
"""How the file of the object begins that most tests only need to be there."""
PICTURE = b"\x89PNG\r\n\x1a\n"


def warm() -> WarmUpReport:
    return WarmUpReport([HAND | {"name": how} for how in HOWS], catalogs=CATALOGS)


def warm_and_report_niceness() -> WarmUpReport:
    """The niceness of the start in place of the hands."""
    return WarmUpReport([{"niceness": os.getpriority(os.PRIO_PROCESS, threading.get_native_id())}])


def inspect(storage: Storage, upload: Upload) -> dict[str, Any]:
    """As the service does it; the usual cube, if it was inspected before in these tests, is kept as it was then.

    Tests of uploads take other files. This needs none of the numeric libraries, whose import takes a process longer
    than all else that it does here.
    """
    content = upload.path.read_bytes()
    if "FAKES_INSPECTED" not in os.environ or not content.startswith(CUBE):
        return inspect_object(storage, upload)
    asked = json.dumps([upload.unit, upload.scale, upload.viewpoint, upload.options], sort_keys=True)
    known = Path(os.environ["FAKES_INSPECTED"]) / hashlib.sha256(content + asked.encode()).hexdigest()
    if not known.exists():
        found = inspect_object(storage, upload)
        made = Path(tempfile.mkdtemp(dir=known.parent))
        (made / "found").write_text(json.dumps(found))
        shutil.copy(storage.local(storage.shape(found["id"])), made / "shape")
        with suppress(OSError):  # another process was first
            made.rename(known)
        return found
    found = json.loads((known / "found").read_text())
    path = storage.shape(found["id"])
    try:
        storage.claim(path)
    except FileNotFoundError:
        with storage.atomic(path) as staged:
            shutil.copy(known / "shape", staged)
    return found


def plan(storage: Storage, task: PlanTask) -> JobOutcome:
    report_progress("splitting", 0.5)
    (_notes(storage) / f"{task.job_id}.threads").write_text(str(task.threads))
    _go(task.request.hand, storage, task.job_id)
    document = result_document(task.object_name, task.request)
    row = JobResultRow(
        result=json.dumps(document),
        grasps=len(document["grasps"]),
        feasible=document["summary"]["feasible"],
        verified=0,
        holding_margin=document["grasps"][0]["metrics"]["holding_margin"],
    )
    return JobOutcome(row, document["timings_ms"], (True, False), 1)


def generate(_storage: Storage, _object_id: str, request: ParallelGraspsGenerate) -> list[dict[str, Any]]:
    z = 0.001 * request.seed
    return [{"contacts": [[0.03, 0.0, z], [-0.03, 0.0, z]], "approach": [0, 0, -1]}] * request.count


def _notes(storage: Storage) -> Path:
    """Where jobs leave notes for the tests."""
    return Path(os.environ.get("FAKES_FOLDER", storage.root))


def _go(how: str, storage: Storage, job_id: str) -> None:
    """Note in which process the job has begun, and let it go as its hand says."""
    folder = _notes(storage)
    begun = folder / f"{job_id}.begun"
    again = begun.exists()
    begun.write_text(str(os.getpid()))
    if how == DIES or (how == DIES_ONCE and not again):
        os.kill(os.getpid(), signal.SIGKILL)
    elif how == HANGS or (how == HANGS_ONCE and not again):
        max(range(10**15))  # in C, holding the interpreter's lock
    elif how == RAISES:
        raise RuntimeError("secret of the inside")
    elif how == TOO_MUCH_MEMORY:
        bytearray(10**15)
    elif how == WAITS:
        while not (folder / "go").exists():
            time.sleep(0.01)


def verify(storage: Storage, task: VerifyTask) -> VerifiedResult:
    """A verification that holds; a file says how many times its worker dies before, and how long it takes."""
    with (storage.root / "verifying").open("a") as order:
        order.write(f"{task.job_id}\n")
    deaths = storage.root / "deaths"
    if deaths.exists() and (left := int(deaths.read_text())):
        deaths.write_text(f"{left - 1}")
        os.kill(os.getpid(), signal.SIGKILL)
    while (storage.root / "hold_verification").exists():
        time.sleep(0.01)
    document = json.loads(task.result)
    document["grasps"][0]["verification"] = filled(Verification, passed=True)
    with storage.atomic(storage.view(task.job_id, 1, "recording.rrd"), make_folder=False) as staged:
        staged.write_bytes(b"recording with a lift")
    return VerifiedResult(json.dumps(document), 1)


def render(storage: Storage, task: RenderTask) -> None:
    curve = {"phases": ["map", "cpo"], "quality": [0.1, 0.2], "residual": [1e-3, 2e-3]}
    content = {"picture.png": PICTURE + bytes([task.rank]), "curve.json": json.dumps(curve).encode()}
    content |= dict.fromkeys(("scene.json.gz", "motion.json.gz"), gzip.compress(b"{}"))
    assert json.loads(task.result)["grasps"][task.rank - 1]["rank"] == task.rank
    with storage.atomic(storage.view(task.job_id, task.rank, task.name), make_folder=False) as staged:
        staged.write_bytes(content.get(task.name, task.name.encode()))


def draw_starts(storage: Storage, task: PlanTask) -> None:
    with storage.atomic(storage.view(task.job_id, 0, STARTS), make_folder=False) as staged:
        staged.write_bytes(gzip.compress(b"{}"))


def write_shard(storage: Storage, task: ShardTask) -> None:
    assert json.loads(task.result)["grasps"]
    with storage.atomic(storage.view(task.job_id, 0, SHARD), make_folder=False) as staged:
        staged.write_bytes(f"shard {task.item.index} {task.number}".encode())


def convert(_storage: Storage, result: str, format_name: str, rank: int | None) -> ExportedFile:
    assert json.loads(result)["grasps"]
    if format_name not in {"moveit", "isaac_grasp"}:
        raise FormatError(f"Unknown format {format_name!r}; known: isaac_grasp, moveit.")
    return ExportedFile(json.dumps({"format": format_name, "rank": rank}).encode(), ".json", "application/json")


def decompose(storage: Storage, object_id: str) -> None:
    """Say what runs where at which priority and in which order, and wait while there is a file ``hold``."""
    with (storage.root / "decomposed").open("a") as order:
        order.write(f"{object_id}\n")
    priority = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
    staged = storage.staged(".json")
    staged.write_text(json.dumps({"pid": os.getpid(), "priority": priority}))
    staged.replace(storage.root / f"{object_id}.decomposing")
    while (storage.root / "hold").exists():
        time.sleep(0.01)


def accept(_storage, _object_id, _grasps):
    """Whatever grasps are given, they touch the object."""


def add_hand(storage: Storage, upload: HandUpload) -> dict[str, Any]:
    """Every zip is a hand."""
    if not zipfile.is_zipfile(upload.path):
        raise HandError("The archive is no zip file.")
    return _keep_hand(storage, upload.path.read_bytes())


def correct_hand(storage: Storage, hand_id: str, description: str) -> dict[str, Any]:
    storage.local(storage.hand(hand_id))
    return _keep_hand(storage, description.encode())


def _keep_hand(storage: Storage, content: bytes) -> dict[str, Any]:
    hand_id = hashlib.sha256(content).hexdigest()[:32]
    with storage.atomic(storage.hand(hand_id)) as staged:
        staged.write_bytes(content)
    return HAND | {"name": hand_id, "sha256": 64 * "0", "drafted": True}


def view_hand(storage: Storage, task: HandTask) -> None:
    content = {
        "report.json": json.dumps({"description": "title = 'A hand'", "report": {"advice": []}}).encode(),
        "trial.json": b"[]",
        "scene.json.gz": gzip.compress(b"{}"),
    }
    with storage.atomic(storage.hand_view(task.key, task.name)) as staged:
        staged.write_bytes(content.get(task.name, PICTURE))


FUNCTIONS = WorkerFunctions(
    warm=warm,
    inspect=inspect,
    decompose=decompose,
    generate=generate,
    check_touching=accept,
    import_grasps=import_grasps,
    plan=plan,
    verify=verify,
    render=render,
    export=export_mesh,
    convert=convert,
    write_shard=write_shard,
    draw_starts=draw_starts,
    add_hand=add_hand,
    correct_hand=correct_hand,
    view_hand=view_hand,
)


def result_document(object_name: str, request: JobCreate) -> dict[str, Any]:
    feasible = request.hand != NO_GRASP
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
        "geometry_valid": feasible,
        "carries_weight": True,
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
        "grip": {
            "forces": [[-2.0, 0.0, 0.0]],
            "supporting": [],
            "torques": {"finger1_base": 0.2},
            "stiffness": {"finger1_base": 17.0},
            "damping": {"finger1_base": 0.34},
            "load": 3.0,
            "friction": [0.36],
            "max_force": 30.0,
            "violation": 0.0,
            "limited": False,
        },
        "iterations": {"outer": 1, "cpo": 2, "ppo": 3},
        "timings_ms": {f"{phase}_{stage}": 0.1 for phase in ("cpo", "ppo") for stage in stages} | {"total": 0.6},
        "initial": state
        | {
            "parallel_grasp": {"contacts": [[0.03, 0, 0], [-0.03, 0, 0]], "approach": [0, 0, -1]},
            "quality": 0.1,
            "verification": None,
        },
        "verification": None,
        "p_hold": {
            "value": 0.8,
            "tier": "estimated",
            "robustness": "fragile",
            "position_noise": 0.005,
            "rotation_noise": 0.087,
        },
    }
    return {
        "schema_version": 2,
        "hand": request.hand,
        "object": {
            "id": request.object_id,
            "name": object_name,
            "source": {"unit": "m", "scale": 1.0, "viewpoint": None, "support": None},
            "options": {"density": None, "mass": None, "friction": None, "fairing": 0.0},
            "report": None,
            "extents": [0.06, 0.06, 0.12],
            "volume": 4e-4,
            "mass": 0.2,
            "mass_basis": "given",
            "center_of_mass": [0.0, 0.0, 0.0],
            "samples": 30000,
            "sample_spacing": 0.001,
            "inertia": [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]],
            "seen": 1.0,
        },
        "seed": request.seed,
        "starts": request.starts,
        "friction": 0.6,
        "provenance": {
            "software_version": "0.1.0",
            "hand_sha256": 64 * "0",
            "planner": {"fidelity": "default"},
            "constraints": {},
            "parallel_grasps": "antipodal",
            "top_k": request.top_k,
        },
        "summary": {
            "started": request.starts,
            "feasible": int(feasible),
            "terminations": {grasp["termination"]: 1},
            "message": f"{int(feasible)} of {request.starts} starts ended in a feasible grasp.",
            "verification": None,
        },
        "timings_ms": {"parallel_grasps": 1.0, "mapping": 1.0, "splitting": 1.0, "ranking": 1.0, "total": 4.0},
        "grasps": [grasp],
    }
