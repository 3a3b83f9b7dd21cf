"""Descriptions that ship for models of others: the user has the model, we say what it cannot."""

import importlib
import importlib.util
import os
from pathlib import Path

from fingersplit.errors import HandError

__all__ = ["FOLDERS_VARIABLE", "described_hands", "find_public_hand"]

FOLDERS_VARIABLE = "FINGERSPLIT_HANDS"
"""Environment variable: a folder with the folders of hand models."""

_DESCRIPTIONS = Path(__file__).parent / "public"

_MODULES = {
    "allegro_wonik": "allegro_hand_mj_description",
    "leap": "leap_hand_mj_description",
    "shadow": "shadow_hand_mj_description",
    "dexee": "shadow_dexee_mj_description",
    "ability": "ability_hand_description",
}
"""Modules of the package robot_descriptions that fetch these models."""

_PLACES = {
    "allegro_wonik": "wonik_allegro",
    "leap": "leap_hand",
    "shadow": "shadow_hand",
    "dexee": "shadow_dexee",
    "ability": "ability_hand",
    "robotiq_3f": "robotiq_3f",
}
"""Their folders, as MuJoCo Menagerie and the original sources call them."""


def described_hands() -> tuple[str, ...]:
    """Names of hands whose description ships and whose model does not."""
    return tuple(sorted(path.stem for path in _DESCRIPTIONS.glob("*.toml")))


def find_public_hand(name: str, folder: str | None) -> tuple[Path, Path]:
    """Description and model folder of a hand whose model is the user's.

    Args:
        name: One of ``described_hands()``.
        folder: Where the user says the model is; None to look below ``FINGERSPLIT_HANDS`` and in robot_descriptions.

    Raises:
        HandError: The model is nowhere.
    """
    description = _DESCRIPTIONS / f"{name}.toml"
    if folder is not None:
        return description, Path(folder).expanduser()
    below = os.environ.get(FOLDERS_VARIABLE)
    if below and (Path(below) / _PLACES[name]).is_dir():
        return description, Path(below) / _PLACES[name]
    fetched = _menagerie(name) or _fetched(name)
    if fetched is not None:
        return description, fetched
    raise HandError(
        f"The description of {name!r} ships, its model does not: write {name}@FOLDER, or put {_PLACES[name]!r} "
        f"below {FOLDERS_VARIABLE}, or install robot_descriptions or mujoco-menagerie."
    )


def _menagerie(name: str) -> Path | None:
    """Folder of the model in the package mujoco-menagerie where it is installed and has it."""
    spec = importlib.util.find_spec("mujoco_menagerie")
    for place in (spec.submodule_search_locations or ()) if spec else ():
        found = next((path for path in sorted(Path(place).rglob(_PLACES[name])) if path.is_dir()), None)
        if found is not None:
            return found
    return None


def _fetched(name: str) -> Path | None:
    """Folder of the model where robot_descriptions is installed and has it."""
    if name not in _MODULES:
        return None
    try:
        module = importlib.import_module(f"robot_descriptions.{_MODULES[name]}")
    except ImportError:
        return None
    path = getattr(module, "MJCF_PATH", None) or getattr(module, "URDF_PATH", None)
    return Path(path).parent if path else None
