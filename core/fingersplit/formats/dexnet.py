"""Dex-Net grasps: HDF5 databases and the JSON of Dex-Net as a service."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import FormatError
from fingersplit.formats.fields import check_count, numbers
from fingersplit.formats.file_format import FileFormat, Request
from fingersplit.formats.grippers import JawPoses

__all__ = ["DEXNET", "DEXNET_SERVICE"]

TYPE = "ParallelJawPtGrasp3D"
SERVICE_ANGLES = 4
"""Approaches about the jaw axis for grasps that come without one."""


def _is_database(file: Any) -> bool:
    return "datasets" in file


def _read_database(file: Any, request: Request) -> JawPoses:
    """The grasps of one object, which a file with several must have under the object's name.

    ``configuration`` is center, axis, greatest width, approach angle, jaw width and, in new files, least width.
    """
    entries = list(_grasps_of(_object(file, request.object_name)))
    check_count(len(entries))
    rows, scores = [], []
    for name, entry in entries:
        kind = _text(entry.attrs.get("type", TYPE))
        if kind != TYPE:
            raise FormatError(f"Grasp {name} is of type {kind!r}; only {TYPE} closes two jaws.")
        configuration = np.asarray(entry.attrs.get("configuration", ()))
        if configuration.shape not in {(9,), (10,)}:
            raise FormatError(
                f"The configuration of grasp {name} has the shape {configuration.shape}; it must be 10 numbers, in old "
                f"files 9."
            )
        rows.append(numbers(configuration[:9], f"configuration of grasp {name}", (9,)))
        scores.append(_score(entry))
    table = np.array(rows)
    lengths = request.scale * table
    return _poses(lengths[:, :3], table[:, 3:6], lengths[:, 6], table[:, 7], np.array(scores))


def _is_service_answer(document: Any) -> bool:
    """Whether a JSON document lists grasps with center and axis."""
    listed = _listed(document)
    return bool(listed) and isinstance(listed[0], dict) and {"center", "axis"} <= set(listed[0])


def _read_service_answer(document: Any, request: Request) -> JawPoses:
    """Grasps by ``center``, ``axis``, ``open_width`` and ``metric_score``; each from ``SERVICE_ANGLES`` sides."""
    listed = _listed(document)
    check_count(len(listed) * SERVICE_ANGLES)
    try:
        centers = request.scale * numbers([entry["center"] for entry in listed], "center", (None, 3))
        axes = numbers([entry["axis"] for entry in listed], "axis", (None, 3))
        widths = request.scale * numbers([entry["open_width"] for entry in listed], "open_width", (None,))
        scores = numbers([entry.get("metric_score", 0.0) for entry in listed], "metric_score", (None,))
    except (KeyError, TypeError, AttributeError) as error:
        missing = f"; one has no {error.args[0]}" if isinstance(error, KeyError) else ""
        raise FormatError(f"Every Dex-Net grasp needs center, axis and open_width{missing}.") from error
    angles = np.tile(2 * np.pi * np.arange(SERVICE_ANGLES) / SERVICE_ANGLES, len(listed))
    centers, axes, widths, scores = (
        np.repeat(each, SERVICE_ANGLES, axis=0) for each in (centers, axes, widths, scores)
    )
    return _poses(centers, axes, widths, angles, scores)


def _poses(
    centers: NDArray[np.float64],
    axes: NDArray[np.float64],
    widths: NDArray[np.float64],
    angles: NDArray[np.float64],
    scores: NDArray[np.float64],
) -> JawPoses:
    """Dex-Net's frame: y along the jaws; x, the approach, in the xy plane, then turned about y by the angle."""
    lengths = np.linalg.norm(axes, axis=1)
    if (lengths < 1e-6).any() or (widths <= 0).any():
        raise FormatError("Every Dex-Net grasp needs an axis with a length and a positive opening width.")
    y = axes / lengths[:, None]
    x = np.stack([y[:, 1], -y[:, 0], np.zeros(len(y))], axis=1)
    upright = np.linalg.norm(x, axis=1) == 0
    x[upright] = (1.0, 0.0, 0.0)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    approaches = np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * np.cross(x, y)
    return JawPoses(
        centers, y, approaches, widths, np.zeros((len(y), 2)), scores - scores.min(), "Dex-Net works in metres."
    )


def _listed(document: Any) -> list[Any]:
    if isinstance(document, dict):
        document = document.get("grasps", [document])
    return document if isinstance(document, list) else []


def _object(file: Any, object_name: str) -> Any:
    objects = {
        key: entry
        for dataset in file["datasets"].values()
        if hasattr(dataset, "items")
        for key, entry in dataset.get("objects", {}).items()
        if "grasps" in entry
    }
    if len(objects) == 1:
        return next(iter(objects.values()))
    if object_name not in objects:
        names = ", ".join(sorted(objects)[:10]) or "none"
        raise FormatError(
            f"The database holds grasps of {len(objects)} objects ({names}); name the mesh file after the one it is."
        )
    return objects[object_name]


def _grasps_of(entry: Any) -> Iterator[tuple[str, Any]]:
    """Grasps below ``grasps``, directly or in one group a gripper."""
    for name, child in entry["grasps"].items():
        if "configuration" in child.attrs:
            yield name, child
        elif hasattr(child, "items"):
            yield from ((f"{name}/{inner}", grasp) for inner, grasp in child.items())


def _score(entry: Any) -> float:
    """The best of a grasp's metrics; 0 where it has none."""
    metrics = entry.get("metrics")
    values = [float(value) for value in metrics.attrs.values() if np.ndim(value) == 0] if metrics is not None else []
    return max((value for value in values if np.isfinite(value)), default=0.0)


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


DEXNET = FileFormat("dexnet", "Dex-Net HDF5", "hdf5", _is_database, read_parallel=_read_database)
DEXNET_SERVICE = FileFormat(
    "dexnet_service", "Dex-Net as a service JSON", "json", _is_service_answer, read_parallel=_read_service_answer
)
