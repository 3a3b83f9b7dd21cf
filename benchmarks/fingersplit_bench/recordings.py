"""Section `recordings`: how long it takes to write a run's recording, and how large it is."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any
from unittest.mock import patch

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.recording.replay import ReplayedGrasp, replay
from fingersplit.recording.run_recording import write_recording
from fingersplit.recording.shading import shade_object
from fingersplit.splitting.trace import Trace
from fingersplit.verification import verify_ranked
from fingersplit_bench.calls import SEED, settings_of
from fingersplit_bench.suite import Bench, Chapter, Figure, table

__all__ = ["measure_recording", "recordings_chapter", "refined", "resampled"]

VERTICES = 20_000
STATES = 121
"""The mapped start and 120 iterations."""
WARM_UP, WRITES_A_REPEAT = 3, 4


def recordings_chapter(bench: Bench) -> Chapter:
    """Record a verified run on every object, brought to ``VERTICES`` vertices where it has fewer."""
    rows = []
    for name, load in bench.objects.items():
        bench.note(f"recording a run on {name}")
        rows += measure_recording(name, load(), bench.hand, bench.repeats)
    meant = [row for row in rows if row["vertices"] == VERTICES]
    meaning = f"Writing the recording of 120 iterations and a lift on an object of {VERTICES:,} vertices, warm."
    times = [time for row in meant for time in row["ms"]]
    beside = {
        "largest_mb": max((row["mb"] for row in meant), default=0.0),
        "object_not_seen_before_ms": float(np.median([row["new_ms"] for row in meant] or [0.0])),
        "rerun_flush_and_close_share": float(np.median([row["closing_share"] for row in meant] or [0.0])),
    }
    figures = {"recording_ms": Figure.of(times, "ms", meaning, **beside)} if times else {}
    return Chapter("Recordings", _table(rows), figures, {"objects": rows})


def measure_recording(name: str, mesh: Mesh, hand: Hand, repeats: int) -> list[dict[str, Any]]:
    """One row with the times of many writes, none if no grasp was found.

    Its run is resampled to ``STATES`` states, so that every object asks the same; the lift is as it was simulated.
    """
    pieces = decompose(mesh)
    model = prepare_object(refined(mesh, VERTICES), name)
    planned = plan(model, hand, seed=SEED, settings=settings_of("paper"))
    if not planned.grasps:
        return []
    verified = verify_ranked(planned, model, hand, pieces, verified=1, protocol="lift_full")
    grasp = max(verified.grasps, key=lambda grasp: (grasp.verification is not None, -grasp.rank))
    replayed = replay(verified, grasp.rank, model, hand, lambda: pieces)
    run = replace(replayed, trace=resampled(replayed.trace, STATES))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.rrd"
        writes = [_write(path, model, hand, run) for _ in range(WARM_UP + WRITES_A_REPEAT * repeats)][WARM_UP:]
        new = []
        for _ in range(repeats):
            shade_object.cache_clear()
            new.append(_write(path, model, hand, run)[0])
        megabytes = path.stat().st_size / 1e6
    times, closing = np.array(writes).T
    return [
        {
            "object": name,
            "vertices": len(model.mesh.vertices),
            "frames": 0 if run.frames is None else len(run.frames.times),
            "mb": megabytes,
            "ms": (1e3 * times).tolist(),
            "new_ms": 1e3 * float(np.median(new)),
            "closing_share": float(np.median(closing / times)),
        }
    ]


def resampled(trace: Trace, states: int) -> Trace:
    """So many states of a trace, evenly spaced from the first to the last; some come twice if it has fewer."""
    rows = np.linspace(0, len(trace) - 1, states).round().astype(np.int64)
    return Trace(**{column.name: getattr(trace, column.name)[rows] for column in fields(Trace)})


def refined(mesh: Mesh, vertices: int) -> Mesh:
    """The same surface with so many vertices, or the mesh itself if it has as many already.

    Edges that are the longest of both their faces are halved, long ones first.
    """
    points, faces = np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    while len(points) < vertices:
        points, faces = _halve_longest_edges(points, faces, vertices - len(points))
    return Mesh(points, faces.astype(np.int32))


def _halve_longest_edges(
    points: NDArray[np.float64], faces: NDArray[np.int64], most: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2)  # (m, 3, 2)
    edges, of_face = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    of_face = of_face.reshape(-1, 3)
    rank = np.empty(len(edges), dtype=np.int64)
    rank[np.argsort(-np.linalg.norm(np.diff(points[edges], axis=1)[:, 0], axis=1), kind="stable")] = np.arange(
        len(edges)
    )
    longest = rank[of_face].argmin(axis=1)
    each = np.arange(len(faces))
    votes = np.bincount(of_face[each, longest], minlength=len(edges))
    agreed = np.flatnonzero(votes == np.bincount(of_face.ravel(), minlength=len(edges)))
    halved = agreed[np.argsort(rank[agreed])][:most]
    middle = np.full(len(edges), -1)
    middle[halved] = len(points) + np.arange(len(halved))
    new = middle[of_face[each, longest]]
    a, b, c = (faces[each, (longest + turn) % 3] for turn in range(3))
    split = new >= 0
    halves = [np.column_stack([a, new, c]), np.column_stack([new, b, c])]
    return (
        np.vstack([points, points[edges[halved]].mean(axis=1)]),
        np.vstack([faces[~split], *(half[split] for half in halves)]),
    )


def _write(path: Path, model: ObjectModel, hand: Hand, run: ReplayedGrasp) -> tuple[float, float]:
    """Time of one recording, and of it what rerun took to flush and close [s]."""
    began = perf_counter()
    with _closing_time() as closing:
        write_recording(path, run, model, hand)
    return perf_counter() - began, sum(closing)


@contextmanager
def _closing_time() -> Iterator[list[float]]:
    """Collects how long rerun flushes and closes [s]."""
    times = list[float]()
    flush, disconnect = rr.RecordingStream.flush, rr.RecordingStream.disconnect

    def timed_flush(stream: rr.RecordingStream) -> None:
        began = perf_counter()
        flush(stream)
        times.append(perf_counter() - began)

    def timed_disconnect(stream: rr.RecordingStream) -> None:
        began = perf_counter()
        disconnect(stream)
        times.append(perf_counter() - began)

    with (
        patch.object(rr.RecordingStream, "flush", timed_flush),
        patch.object(rr.RecordingStream, "disconnect", timed_disconnect),
    ):
        yield times


def _table(rows: list[dict[str, Any]]) -> str:
    headings = [
        "object",
        "vertices",
        "frames of the lift",
        "MB",
        "warm [ms]",
        "quartiles",
        "object not seen before [ms]",
    ]
    cells = []
    for row in rows:
        low, middle, high = np.quantile(row["ms"], (0.25, 0.5, 0.75))
        times = [f"{middle:.1f}", f"{low:.1f} to {high:.1f}", f"{row['new_ms']:.1f}", f"{row['closing_share']:.0%}"]
        cells.append([row["object"], f"{row['vertices']:,}", str(row["frames"]), f"{row['mb']:.2f}", *times])
    return (
        f"{table([*headings, 'rerun flushes and closes'], cells)}\n\nRuns are resampled to {STATES} states, objects of "
        f"fewer than {VERTICES:,} vertices get as many by halved edges. A worker shades an object's mesh once."
    )
