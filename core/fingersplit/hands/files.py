"""Where a hand's files are: by the name of one that ships, in a folder, or in a zip."""

import hashlib
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fingersplit.errors import HandError, UnknownHandError
from fingersplit.hands.archive import unpack
from fingersplit.hands.description import HandDescription, read_description
from fingersplit.hands.public_hands import described_hands, find_public_hand
from fingersplit.hands.scratch import scratch_folder

__all__ = ["DESCRIPTION", "HandFiles", "find_hand", "find_models", "is_shipped", "shipped_hands"]

DESCRIPTION = "hand.toml"

_FOLDER = Path(__file__).parent
_REFERENCE = re.compile(rb"""(?:file|filename|fileright|fileup)\s*=\s*["']([^"']+)["']""")
_MODEL_SUFFIXES = {".xml", ".urdf", ".mjcf"}


@dataclass(frozen=True, eq=False)
class HandFiles:
    """A hand's description, its model file and the folder that all its files lie in."""

    name: str
    root: Path
    model: Path
    description: HandDescription
    sha256: str


def is_shipped(name: str) -> bool:
    """Whether a hand of that name ships with its model."""
    return name in shipped_hands()


@cache
def shipped_hands() -> tuple[str, ...]:
    """Names of the hands that ship with their models."""
    return tuple(sorted(description.parent.name for description in _FOLDER.glob(f"*/{DESCRIPTION}")))


def find_hand(source: str | Path) -> HandFiles:
    """Files of a hand.

    Args:
        source: Name of a hand that ships, a folder with ``hand.toml``, or a zip of one; or NAME@FOLDER for a model of
            the user whose description ships.

    Raises:
        UnknownHandError: Neither a name nor anything on disk.
        HandError: A folder or zip without a description, or with one that is wrong.
    """
    if isinstance(source, str) and is_shipped(source):
        return _read_folder(_FOLDER / source, source, _FOLDER)
    name, _, folder = str(source).partition("@")
    if name in described_hands() and not Path(source).exists():
        return _read_public(name, folder or None)
    path = Path(source)
    if path.is_dir():
        return _read_folder(path, path.resolve().name)
    if path.is_file():
        return _read_folder(_unpacked(path), path.stem)
    raise UnknownHandError(str(source), shipped_hands())


def find_models(folder: Path) -> list[Path]:
    """Model files in a folder: MJCF with bodies and URDF, those that others include left out."""
    candidates = [
        path for path in sorted(folder.rglob("*")) if path.suffix.lower() in _MODEL_SUFFIXES and path.is_file()
    ]
    texts = {path: path.read_bytes() for path in candidates}
    included = {
        Path(name.decode(errors="replace")).name for text in texts.values() for name in _REFERENCE.findall(text)
    }
    models = [p for p, text in texts.items() if (b"<body" in text or b"<robot" in text) and p.name not in included]
    return [path for path in models if not path.name.startswith("scene")]


def _read_folder(folder: Path, name: str, whole: Path | None = None) -> HandFiles:
    """The hand in a folder; its model lies in there, or in ``whole``."""
    places = [folder / DESCRIPTION] if (folder / DESCRIPTION).is_file() else sorted(folder.glob(f"*/{DESCRIPTION}"))
    if len(places) != 1:
        what = "no" if not places else "more than one"
        models = [str(model.relative_to(folder)) for model in find_models(folder)]
        hint = f"; `fingersplit hand draft {models[0]} -o DIR` proposes one" if models and not places else ""
        raise HandError(f"{name} holds {what} {DESCRIPTION}{hint}.")
    try:
        text = places[0].read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise HandError(f"{name}/{DESCRIPTION} is not UTF-8 text: {error.reason}.") from error
    description = read_description(text, f"{name}/{DESCRIPTION}")
    root = places[0].parent
    model = (root / description.model).resolve()
    if not model.is_relative_to((whole or root).resolve()) or not model.is_file():
        raise HandError(f"{name}/{DESCRIPTION}: the model {description.model!r} is not a file beside it.")
    return HandFiles(name, root, model, description, _digest(text, model, model.parent))


def _read_public(name: str, folder: str | None) -> HandFiles:
    """A hand whose description ships and whose model the user has."""
    place, root = find_public_hand(name, folder)
    text = place.read_text()
    description = read_description(text, place.name)
    model = root / description.model
    if not model.is_file():
        raise HandError(f"{name}: the model {description.model!r} is not in {root}.")
    return HandFiles(name, root, model, description, _digest(text, model, root))


def _unpacked(path: Path) -> Path:
    data = path.read_bytes()
    folder = scratch_folder() / hashlib.sha256(data).hexdigest()
    if not folder.is_dir():
        unpack(data, folder)
    return folder


def _digest(description: str, model: Path, root: Path) -> str:
    """SHA-256 of the description, the model file and every file below ``root`` that they or an include name."""
    digest, waiting, seen = hashlib.sha256(description.encode()), [model], {model}
    files: dict[str, list[Path]] = {}
    for path in sorted(root.rglob("*")):
        files.setdefault(path.name, []).append(path)
    while waiting:
        path = waiting.pop(0)
        data = path.read_bytes()
        digest.update(hashlib.sha256(data).digest())
        if path.suffix.lower() not in _MODEL_SUFFIXES:
            continue
        for reference in _REFERENCE.findall(data):
            for other in files.get(Path(reference.decode(errors="replace").replace("\\", "/")).name, []):
                if other not in seen and other.is_file():
                    seen.add(other)
                    waiting.append(other)
    return digest.hexdigest()
