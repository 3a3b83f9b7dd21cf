"""Section `objects`: time to read, prepare and load them, and how exact the nearest point and its normal are.

``python -m fingersplit_bench.objects_report [MESH ...]`` prints it alone, and the peak memory of named meshes.
"""

import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.cache import ContentCache
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.scatter import scatter
from fingersplit.objects.source import ObjectSource
from fingersplit.objects.surface_kernel import closest, touch
from fingersplit_bench.objects import benchmark_objects
from fingersplit_bench.suite import Bench, Chapter

__all__ = ["main", "measure_preparation", "nearest_errors", "objects_chapter", "objects_table", "peak_memory"]

QUERIES = 2_000
HEIGHTS = (-1e-3, 15e-3)
"""Between these, queries stand off the surface [m]: where fingertips are, and what they dive in."""
ASIDE = 1e-3
"""[m]; standard deviation of what they stand beside the normal, so that edges are met from all sides."""
PERCENTILES = (50, 95, 99, 100)


def objects_chapter(bench: Bench) -> Chapter:
    """Measure every object."""
    rows = []
    for name, load in bench.objects.items():
        bench.note(f"reading and preparing {name}")
        rows.append(measure_preparation(name, load, bench.repeats))
    text = f"{objects_table(rows)}\n\nErrors are percentiles 50 / 95 / 99 / 100, against the triangles."
    return Chapter("Preparing objects", text, data={"objects": rows})


def measure_preparation(name: str, load: Callable[[], Mesh], repeats: int) -> dict[str, Any]:
    """Median times of intake, preparation and loading, and the errors of nearest points, of one object."""
    seconds: dict[str, list[float]] = {"intake": [], "prepare": [], "load": []}
    for _ in range(repeats):
        began = perf_counter()
        mesh = load()
        read = perf_counter()
        model = prepare_object(mesh, name)
        seconds["intake"].append(read - began)
        seconds["prepare"].append(perf_counter() - read)
    with tempfile.TemporaryDirectory() as folder:
        cache = ContentCache(Path(folder), 1_000_000_000)
        cache.fetch(name, model.to_arrays)
        for _ in range(repeats):
            began = perf_counter()
            arrays = cache.fetch(name, model.to_arrays)
            ObjectModel.from_arrays(arrays, name, ObjectOptions(), ObjectSource(), None)
            seconds["load"].append(perf_counter() - began)
    return {
        "object": name,
        "vertices": len(mesh.vertices),
        "samples": len(model.surface.normals),
        **{f"{stage}_ms": 1e3 * median(times) for stage, times in seconds.items()},
        **nearest_errors(model),
    }


def nearest_errors(model: ObjectModel, count: int = QUERIES) -> dict[str, list[float]]:
    """Percentiles of errors of the nearest point against exact distances to the triangles, and of its normal.

    Queries stand about points of the triangles, which are no samples. ``closest_mm`` is the error of the distance to
    the point that ``closest`` finds; ``touch_mm`` is that of the distance that ``touch`` finds; ``off_mm`` is how far
    ``closest``'s point lies off the triangles; ``normal_deg`` is the angle between its normal and that of the nearest
    triangle.
    """
    rng, surface = np.random.default_rng(0), model.surface
    feet, below = scatter(model.mesh, count, rng)
    queries = feet + rng.uniform(*HEIGHTS, (count, 1)) * model.mesh.trimesh.face_normals[below]
    queries += rng.normal(scale=ASIDE, size=queries.shape)
    _, exact, faces = _on_triangles(model.mesh, queries)
    found = [closest(surface, tuple(query), -1) for query in queries]
    points, normals = np.array([point for _, point, _ in found]), np.array([normal for _, _, normal in found])
    touched = np.array([touch(surface, tuple(query), -1)[0] for query in queries])
    _, off, _ = _on_triangles(model.mesh, points)
    cosines = np.einsum("ij,ij->i", normals, model.mesh.trimesh.face_normals[faces])
    errors = {
        "closest_mm": 1e3 * np.abs(np.linalg.norm(queries - points, axis=1) - exact),
        "off_mm": 1e3 * off,
        "touch_mm": 1e3 * np.abs(touched - exact),
        "normal_deg": np.degrees(np.arccos(np.clip(cosines, -1, 1))),
    }
    return {name: np.percentile(values, PERCENTILES).tolist() for name, values in errors.items()}


def _on_triangles(
    mesh: Mesh, points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Nearest points of the triangles (n, 3) [m], distances (n,) [m] and faces (n,), by trimesh."""
    nearest, distances, faces = mesh.trimesh.nearest.on_surface(points)
    return nearest, distances, faces


def peak_memory(file: Path) -> int:
    """Peak memory [bytes] of a process of its own that reads and prepares a mesh file [m]."""
    code = (
        "import resource, sys; from fingersplit.objects.loading import load_object\n"
        "load_object(sys.argv[1])\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(file)], capture_output=True, text=True, check=True)
    return int(done.stdout) * (1 if sys.platform == "darwin" else 1024)


def objects_table(rows: list[dict[str, Any]]) -> str:
    """Markdown of the times and of the errors at the percentiles 50 / 95 / 99 / 100."""
    lines = [
        "| object | #vertices | intake [ms] | prepare [ms] | load [ms] "
        "| distance of closest [mm] | closest off mesh [mm] | touch [mm] | normal [deg] |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        errors = (row[name] for name in ("closest_mm", "off_mm", "touch_mm", "normal_deg"))
        cells = [" / ".join(f"{value:.3g}" for value in each) for each in errors]
        lines.append(
            f"| {row['object']} | {row['vertices']:,} | {row['intake_ms']:.0f} | {row['prepare_ms']:.0f} "
            f"| {row['load_ms']:.1f} | {' | '.join(cells)} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Print the table of all objects, and the peak memory of every mesh file that is named on the command line."""
    for name in sys.argv[1:]:
        print(f"{Path(name).name}: {1e-6 * peak_memory(Path(name)):,.0f} MB at most, libraries included")
    objects = benchmark_objects(None).items()
    print(objects_table([measure_preparation(name, load, 5) for name, load in objects]))


if __name__ == "__main__":
    main()
