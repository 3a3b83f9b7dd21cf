"""Convex pieces in the section `verification`: how long they take, and how close they are to the surface."""

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
import trimesh

from fingersplit.objects.convex_pieces import ConvexPieces, decompose
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_bench.suite import Bench, Figure, table

__all__ = ["measure_pieces", "pieces_figure", "pieces_table", "surface_errors"]

POINTS = 4_000
SMALL_MESH = 12_000
"""Meshes of fewer faces count as small."""


def measure_pieces(bench: Bench) -> tuple[list[dict[str, Any]], dict[str, ConvexPieces]]:
    """Rows for `pieces_table`, of the objects and of our own ones with few faces; and the pieces by object."""
    own = {f"{name} (parametric)": make for name, make in PARAMETRIC_OBJECTS.items() if name not in bench.objects}
    rows, kept = [], {}
    loaders: dict[str, Callable[[], Mesh]] = {**bench.objects, **own}
    for name, load in loaders.items():
        mesh = load()
        if name in own and len(mesh.faces) >= SMALL_MESH:
            continue
        bench.note(f"convex pieces of {name}")
        began = perf_counter()
        pieces = decompose(mesh)
        seconds = perf_counter() - began
        kept[name] = pieces
        rows.append(
            {
                "object": name,
                "faces": len(mesh.faces),
                "method": pieces.method,
                "pieces": len(pieces.pieces),
                "seconds": seconds,
                **surface_errors(mesh, pieces),
            }
        )
    return rows, kept


def surface_errors(mesh: Mesh, pieces: ConvexPieces) -> dict[str, float]:
    """How far points of the mesh's surface lie from the pieces' [mm]: mean, 95th percentile, largest."""
    points, _ = trimesh.sample.sample_surface(mesh.trimesh, POINTS, seed=0)
    errors = 1e3 * np.abs(pieces.distance(points))
    return {"mean_mm": errors.mean(), "most_mm": float(np.percentile(errors, 95)), "largest_mm": errors.max()}


def pieces_figure(rows: list[dict[str, Any]]) -> Figure:
    """The time for meshes of some thousand faces; the longest of all beside it."""
    all_of_them = [row["seconds"] for row in rows]
    small = [row["seconds"] for row in rows if row["faces"] < SMALL_MESH] or all_of_them
    meaning = f"Convex pieces of a mesh with fewer than {SMALL_MESH:,} faces."
    return Figure.of(small, "s", meaning, longest=max(small), longest_of_all=max(all_of_them))


def pieces_table(rows: list[dict[str, Any]]) -> str:
    """Markdown: faces, pieces, time and errors by object."""
    cells = [
        [
            row["object"],
            row["method"],
            f"{row['faces']:,}",
            str(row["pieces"]),
            f"{row['seconds']:.2f}",
            f"{row['mean_mm']:.2f} / {row['most_mm']:.2f} / {row['largest_mm']:.2f}",
        ]
        for row in rows
    ]
    headings = ["object", "method", "faces", "pieces", "time [s]", "mean / 95 % / largest error [mm]"]
    return table(headings, cells, left=2) + (
        "\n\nErrors are distances between points of the mesh's surface and the pieces' surface; one thread."
    )
