"""Section `intake`: every file of a folder is read and planned for, each in a process that can be killed."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from fingersplit.objects.intake import FORMATS, IntakeReport
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.source import UNITS
from fingersplit_bench.killable import Crashed, KillableWorker, Slow
from fingersplit_bench.suite import Bench, Chapter, table
from fingersplit_bench.winding_kernel import winding_numbers

__all__ = ["intake_chapter", "reference_volume", "try_file"]

SECONDS = 60.0
"""A file may take so long, from its bytes to ranked grasps."""
EVALUATIONS = 60_000_000
"""Solid angles that a reference volume is made of, at most."""
MAX_POINTS = 4_000
FAR_OFF = 0.05
"""Share of the reference beyond which a volume is marked, where chance makes less."""


def intake_chapter(bench: Bench) -> Chapter:
    """Try every file of the folder, or our own objects where there is none."""
    rows = list[dict[str, Any]]()
    with _corpus(bench.corpus) as folder, KillableWorker(try_file, SECONDS) as worker:
        files = sorted(path for path in folder.rglob("*") if path.suffix.lower().removeprefix(".") in FORMATS)
        for path in files:
            bench.note(f"trying {path.name}")
            began = perf_counter()
            row: dict[str, Any] = {"file": str(path.relative_to(folder))}
            try:
                row |= worker.call(str(path), bench.hand.name, bench.starts)
            except Slow as slow:
                row |= {"outcome": "slow", "reason": str(slow)}
            except Crashed as crash:
                row |= {"outcome": "crashed", "reason": str(crash)}
            rows.append(row | {"seconds": perf_counter() - began})
    counts = Counter(row["outcome"] for row in rows)
    summary = ", ".join(f"{count} {outcome}" for outcome, count in counts.most_common())
    text = f"{len(rows)} files: {summary or 'none'}.\n\n{_table(rows)}\n\n" + (
        "Units are the first that make a plausible size. The reference is the share of random points in the bounding "
        "box whose generalised winding number, summed over the file's triangles, is above one half; it is not exact "
        "where openings are large. A star marks volumes that differ by more than "
        f"{FAR_OFF:.0%} and three standard deviations."
    )
    return Chapter("Files of a folder", text, data={"files": rows, "counts": dict(counts)})


@contextmanager
def _corpus(folder: Path | None) -> Iterator[Path]:
    if folder is not None:
        yield folder
        return
    with TemporaryDirectory() as own:
        for name, make in PARAMETRIC_OBJECTS.items():
            make().trimesh.export(Path(own) / f"{name}.ply")
        yield Path(own)


def try_file(path: str, hand: str, starts: int) -> dict[str, Any]:
    """Read a file, prepare its object and plan; runs in the worker."""
    from fingersplit.errors import ObjectFileError
    from fingersplit.hands.hand import load_hand
    from fingersplit.planning.planning import plan

    row: dict[str, Any] = {}
    for unit in UNITS:
        row["unit"] = unit
        try:
            model, began = _prepared(Path(path), unit, row), perf_counter()
            break
        except ObjectFileError as error:
            row |= {"outcome": "refused", "code": error.code, "reason": str(error)}
            if error.code not in ("too_large", "too_small"):
                return row
    else:
        return row
    result = plan(model, load_hand(hand), starts=starts)
    row |= {"plan_s": perf_counter() - began, "feasible": result.feasible, "code": "", "reason": ""}
    row["outcome"] = "planned" if result.feasible else "no grasp"
    if not result.feasible:
        row["reason"] = result.message
    return row


def _prepared(path: Path, unit: str, row: dict[str, Any]) -> Any:
    from fingersplit.objects.loading import load_object

    began = perf_counter()
    model = load_object(path, unit=unit)
    row |= {"prepare_s": perf_counter() - began, "volume": model.mass_properties.volume, "mass": model.mass}
    report = model.report
    if report is not None:
        row["remarks"] = report.remarks
    if isinstance(report, IntakeReport):
        row["volume_method"] = report.volume_method
        row["reference"], row["deviation"] = reference_volume(model.mesh)
    return model


def reference_volume(mesh: Mesh) -> tuple[float, float]:
    """Volume by winding numbers at random points, and its standard deviation [m^3]."""
    count = int(min(MAX_POINTS, max(200, EVALUATIONS // len(mesh.faces))))
    low, high = mesh.bounds
    points = np.random.default_rng(0).uniform(low, high, (count, 3))
    numbers = np.empty(count)
    winding_numbers(mesh.vertices, mesh.faces, points, numbers)
    share, box = float(np.mean(numbers > 0.5)), float(mesh.extents.prod())
    return share * box, box * float(np.sqrt(max(share * (1 - share), 1 / count) / count))


def _table(rows: list[dict[str, Any]]) -> str:
    headings = ["file", "outcome", "unit", "feasible", "cm3", "from", "reference cm3", "s", "reason or remarks"]
    return table(headings, [_cells(row) for row in rows], left=3)


def _cells(row: dict[str, Any]) -> list[str]:
    volume, reference = row.get("volume"), row.get("reference")
    cells = [row["file"], row["outcome"], row.get("unit", ""), str(row.get("feasible", ""))]
    cells += ["" if volume is None else f"{1e6 * volume:.2f}", row.get("volume_method", "")]
    text = ""
    if reference is not None and volume is not None:
        far = abs(volume - reference) > max(FAR_OFF * reference, 3 * row["deviation"])
        text = f"{1e6 * reference:.1f} ± {1e6 * row['deviation']:.1f}{' *' if far else ''}"
    words = row.get("reason") or " ".join(row.get("remarks", []))
    return [*cells, text, f"{row['seconds']:.1f}", words.replace("|", "/").replace("\n", " ")]
