"""Scenes on the command line: a file, a table, directions of approach."""

import json
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fingersplit.errors import SceneError
from fingersplit.objects.loading import load_object
from fingersplit.objects.source import ObjectSource
from fingersplit.scene import ApproachCone, Constraints, Scene, SupportSurface

__all__ = ["read_constraints", "support_in_file"]


def read_constraints(file: Path | None, table: bool, approach: Sequence[str]) -> Constraints:
    """The constraints of a request.

    Args:
        file: JSON with the entries of ``Constraints``; objects among the obstacles are files beside it.
        table: Whether a table is added, if the scene has no support surface.
        approach: Cones as ``ApproachCone.parse`` reads them; they replace those of the file.

    Raises:
        SceneError: The file is no JSON, or an entry that cannot be used.
        MeshError: A file of an obstacle that cannot be read.
    """
    constraints = Constraints() if file is None else Constraints.from_document(_json(file))
    if file is not None:
        folder = file.parent
        constraints = constraints.resolved(lambda path: load_object(folder / path))
    scene = constraints.scene
    if table and not scene.support_surfaces:
        scene = replace(scene, support_surfaces=(SupportSurface(),))
    constraints = replace(constraints, scene=scene)
    if approach:
        cones = tuple(ApproachCone.parse(text) for text in approach)
        constraints = replace(constraints, approach=replace(constraints.approach, directions=cones))
    return constraints


def support_in_file(
    scene: Scene, source: ObjectSource, file: Path | None = None
) -> tuple[float, float, float, float] | None:
    """The support surface that the object stands on, as `load_object` takes it.

    None where its pose is not given, or where `from-depth --no-complete` wrote the object's file.
    """
    plane = scene.support_in_object
    if plane is None or (file is not None and _is_to_stay_open(file)):
        return None
    x, y, z, offset = plane.tolist()
    return x, y, z, offset / source.meters


def _is_to_stay_open(file: Path) -> bool:
    if file.suffix.lower() != ".npz":
        return False
    try:
        with np.load(file) as arrays:
            return "complete" in arrays and not bool(arrays["complete"].all())
    except (OSError, ValueError, zipfile.BadZipFile):  # reading the object tells what is wrong with it
        return False


def _json(file: Path) -> object:
    try:
        document: object = json.loads(file.read_text("utf-8-sig"))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        where = f" beyond line {error.lineno}" if isinstance(error, json.JSONDecodeError) else " in UTF-8"
        raise SceneError("", f"{file} is no JSON{where}.") from error
    return document
