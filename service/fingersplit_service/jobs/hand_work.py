"""What workers do with hands: unpack and compile an upload, correct a description, check, try and draw.

An upload is hostile until it is compiled: everything here runs in a process with limits of time and memory.
"""

import gzip
import hashlib
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from zipfile import ZIP_DEFLATED, ZipFile

from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.hands.hand import Hand

__all__ = ["HandTask", "HandUpload", "HandViewName", "add_hand", "correct_hand", "stored_hand", "view_hand"]

HandViewName = Literal["report.json", "trial.json", "picture.png", "scene.json.gz"]
"""What can be made of a hand to look at."""


@dataclass(frozen=True)
class HandUpload:
    """An uploaded archive of a hand.

    Attributes:
        path: The zip.
        name: What its sender calls it.
        model: Model file in it, where there are several and no description.
        palm: Body of the palm for a draft; None to find it.
        fingers: Last bodies of the fingers for a draft; none to find them.
    """

    path: Path
    name: str
    model: str | None = None
    palm: str | None = None
    fingers: tuple[str, ...] = ()


@dataclass(frozen=True)
class HandTask:
    """A view of a hand for a worker to make.

    Attributes:
        name: The view.
        hand: The hand's name or id.
        key: Where its views are kept.
    """

    name: HandViewName
    hand: str
    key: str


def stored_hand(storage: Storage, name: str) -> "Hand":
    """A hand by its name or, of an uploaded one, its id.

    Raises:
        UnknownHandError: No hand ships under this name, and none is kept, maybe not any more.
    """
    from fingersplit.hands.hand import load_hand

    return load_hand(_source(storage, name))


def add_hand(storage: Storage, upload: HandUpload) -> dict[str, Any]:
    """Unpack an archive, draft its description if it has none, compile it, check it, and keep it.

    Returns:
        What ``HandInfo`` says of it.

    Raises:
        HandError: The archive is refused, or holds no hand that can be planned with.
    """
    from fingersplit.hands.archive import unpack
    from fingersplit.hands.files import DESCRIPTION

    with _workplace(storage) as workplace:
        folder = workplace / upload.name
        unpack(upload.path.read_bytes(), folder)
        if not any(folder.glob(DESCRIPTION)) and not any(folder.glob(f"*/{DESCRIPTION}")):
            _draft(folder, upload)
        return _keep(storage, folder)


def correct_hand(storage: Storage, hand_id: str, description: str) -> dict[str, Any]:
    """Keep the files of a hand with another description as a hand of its own.

    Returns:
        What ``HandInfo`` says of it.

    Raises:
        HandError: With this description it is no hand that can be planned with.
        FileNotFoundError: The hand was deleted meanwhile.
    """
    from fingersplit.hands.archive import unpack
    from fingersplit.hands.files import DESCRIPTION, find_hand

    with _workplace(storage) as workplace:
        folder = workplace / "corrected"
        unpack(storage.local(storage.hand(hand_id)).read_bytes(), folder)
        (find_hand(folder).root / DESCRIPTION).write_text(description, encoding="utf-8")
        return _keep(storage, folder)


def view_hand(storage: Storage, task: HandTask) -> None:
    """Make what somebody wants to see of a hand.

    Raises:
        UnknownHandError: It was deleted meanwhile.
    """
    from fingersplit.hands.hand import load_hand

    source = _source(storage, task.hand)
    hand = load_hand(source)
    with storage.atomic(storage.hand_view(task.key, task.name), durable=False) as staged:
        match task.name:
            case "report.json":
                staged.write_text(json.dumps(_report(hand, source)))
            case "trial.json":
                from fingersplit.planning.hand_trial import try_hand

                staged.write_text(json.dumps(try_hand(hand)))
            case "picture.png":
                from fingersplit.recording.hand_pictures import draw_hand

                draw_hand(staged, hand)
            case "scene.json.gz":
                from fingersplit.recording.web_scene import hand_scene

                staged.write_bytes(
                    gzip.compress(json.dumps(hand_scene(hand), separators=(",", ":")).encode(), 6, mtime=0)
                )


def _source(storage: Storage, name: str) -> str | Path:
    """What a hand is loaded from."""
    from fingersplit.hands.files import is_shipped

    if not is_shipped(name):
        with suppress(FileNotFoundError):
            return storage.local(storage.hand(name))
    return name


@contextmanager
def _workplace(storage: Storage) -> Iterator[Path]:
    """A folder for a while."""
    folder = storage.staged("")
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _draft(folder: Path, upload: HandUpload) -> None:
    """Write a proposal for the description beside the model.

    Raises:
        HandError: No model, or several and none is named; or as ``draft_folder``.
    """
    from fingersplit.errors import HandError
    from fingersplit.hands.draft import draft_folder
    from fingersplit.hands.files import find_models

    found = {path.relative_to(folder).as_posix(): path for path in find_models(folder)}
    named = upload.model or (next(iter(found)) if len(found) == 1 else None)
    if named is None or named not in found:
        listed = ", ".join(found) or "none"
        raise HandError(
            f"The archive holds no hand.toml, and its model files are: {listed}. Name one of them as model."
        )
    draft_folder(found[named], folder, folder, upload.palm, upload.fingers)


def _keep(storage: Storage, folder: Path) -> dict[str, Any]:
    """Pack the folder of a hand and keep it once it has been compiled and checked from there."""
    from fingersplit.hands.hand import load_hand

    packed, hand_id = _packed(folder), _content_id(folder)
    hand = load_hand(packed)
    report = _report(hand, packed)
    report["report"]["name"] = hand_id
    try:
        storage.claim(storage.hand(hand_id))
    except FileNotFoundError:
        with storage.atomic(storage.hand(hand_id)) as staged:
            shutil.copy(packed, staged)
    with storage.atomic(storage.hand_view(hand_id, "report.json"), durable=False) as staged:
        staged.write_text(json.dumps(report))
    return hand.to_document() | {"name": hand_id, "drafted": hand.description.drafted}


def _packed(folder: Path) -> Path:
    """A zip of a folder, beside it."""
    path = folder.with_name(f"{folder.name}.zip")
    with ZipFile(path, "w", ZIP_DEFLATED) as target:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                target.write(file, file.relative_to(folder).as_posix())
    return path


def _report(hand: "Hand", source: str | Path) -> dict[str, Any]:
    from fingersplit.hands.check import check_hand
    from fingersplit.hands.files import DESCRIPTION, find_hand

    root = find_hand(source).root
    return {"description": (root / DESCRIPTION).read_text("utf-8"), "report": check_hand(hand)}


def _content_id(folder: Path) -> str:
    """Hash of the names and contents of all files of a folder."""
    digest = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = path.relative_to(folder).as_posix().encode()
        digest.update(len(name).to_bytes(4, "little") + name + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:32]
