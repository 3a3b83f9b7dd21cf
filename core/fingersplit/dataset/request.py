"""What a data set is to hold: objects, hand, how many grasps of each, and everything they depend on."""

import hashlib
from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Self

from fingersplit.errors import DatasetError

__all__ = [
    "BARREN",
    "MAX_ROUND",
    "SCHEMA",
    "SCHEMA_VERSION",
    "SPLITS",
    "SUFFIXES",
    "DatasetObject",
    "DatasetRequest",
    "divide",
    "find_objects",
    "manifest_of",
]

SCHEMA, SCHEMA_VERSION = "fingersplit-dataset", 1
SPLITS = ("train", "validation", "test")
SUFFIXES = (".glb", ".npz", ".obj", ".off", ".pcd", ".ply", ".stl")
"""Files that are taken from a folder."""
MAX_ROUND = 100
"""Most grasps that one round returns; services have the same limit."""

BARREN = 3
"""Rounds in a row without a grasp that counts, after which an object is given up."""


@dataclass(frozen=True)
class DatasetObject:
    """One object of a data set.

    Attributes:
        index: Place in the order.
        name: Name of its file without the ending.
        file: Name of its file.
        sha256: Hash of the file.
        split: ``train``, ``validation`` or ``test``.
    """

    index: int
    name: str
    file: str
    sha256: str
    split: str

    @property
    def label(self) -> str:
        """Index and name, as file names have them."""
        kept = "".join(c if c.isalnum() or c in "-_" else "-" for c in self.name)
        return f"{self.index:05d}-{kept[:60]}"


@dataclass(frozen=True)
class DatasetRequest:
    """Everything that the grasps of a data set depend on, beside the objects: equal orders give equal grasps.

    Attributes:
        hand: Name, folder or archive of the hand.
        per_object: Grasps wanted of each object: held ones where ``verified``, else feasible ones.
        verified: Whether every grasp that counts must have held in simulation.
        starts: Starts of one round.
        max_rounds: Rounds after which an object is given up with what it has.
        seed: Seed of the first round; every next one has the next number.
        unit, scale: How the numbers of the objects' files become metres.
        density, mass, friction, fairing: What is known of the objects, see ``ObjectOptions``.
        protocol, controller: How grasps are verified.
        simulated_friction: Friction in the simulation; None for the planned one.
        source: Where parallel grasps come from.
        planner: Planner settings that differ from their defaults.
        constraints: Scene, approach, contact regions, task and end effector as JSON data.
        split: Shares of train, validation and test.
        licence: Licence under which the data set is given.
    """

    hand: str = "barrett"
    per_object: int = 100
    verified: bool = False
    starts: int = 64
    max_rounds: int = 50
    seed: int = 0
    unit: str = "m"
    scale: float = 1.0
    density: float | None = None
    mass: float | None = None
    friction: float | None = None
    fairing: float = 0.0
    protocol: str = "lift"
    controller: str = "virtual_frame"
    simulated_friction: float | None = None
    source: str = "antipodal"
    planner: dict[str, Any] = field(default_factory=dict)
    constraints: dict[str, Any] = field(default_factory=dict)
    split: tuple[float, float, float] = (0.8, 0.1, 0.1)
    licence: str = "unspecified"

    def __post_init__(self) -> None:
        for name in ("per_object", "starts", "max_rounds"):
            if getattr(self, name) < 1:
                raise DatasetError(f"{name} is {getattr(self, name)}; it must be at least 1.")
        if self.seed < 0:
            raise DatasetError(f"seed is {self.seed}; it must not be negative.")
        if len(self.split) != 3 or min(self.split) < 0 or sum(self.split) <= 0:
            raise DatasetError(f"split is {self.split}; it must be three shares of train, validation and test.")

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """The request that a data set's manifest holds.

        Raises:
            DatasetError: It has other fields.
        """
        known = {one.name for one in fields(cls)}
        if document.keys() != known:
            different = sorted(document.keys() ^ known)
            raise DatasetError(
                f"The manifest's 'order' has other fields than this version knows: {', '.join(different)}."
            )
        return cls(**document | {"split": tuple(document["split"])})

    def to_document(self) -> dict[str, Any]:
        """The request as plain JSON data."""
        return asdict(self) | {"split": list(self.split)}

    def round_seed(self, number: int) -> int:
        """Seed of a round; ``fingersplit plan --seed`` with it gives the round's grasps again."""
        return self.seed + number

    @property
    def top_k(self) -> int:
        """Most grasps that a round returns."""
        return min(self.starts, MAX_ROUND)


def find_objects(paths: Iterable[Path], split: Sequence[float]) -> tuple[list[DatasetObject], list[Path], list[str]]:
    """The objects of files and folders, in the order of their names within a folder.

    Splits are drawn by the hash of the file: objects are sorted by it and cut at the shares, so that an object is in
    one split whatever it is called.

    Args:
        paths: Files, or folders whose meshes and clouds are taken, also from folders below.
        split: Shares of train, validation and test.

    Returns:
        The objects, their files in the same order, and a sentence for every file that was left out as a copy.

    Raises:
        DatasetError: A path does not exist, or there is no object.
    """
    files, names, remarks = dict[str, Path](), list[str](), list[str]()
    for file in _files(paths):
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        if digest in files:
            remarks.append(f"{file} is left out: it is the same file as {files[digest]}.")
        else:
            files[digest] = file
            names.append(digest)
    if not files:
        raise DatasetError(f"There is no object; endings of their files are {', '.join(SUFFIXES)}.")
    parts = divide(files, split)
    objects = [
        DatasetObject(index, files[sha].stem, files[sha].name, sha, parts[sha]) for index, sha in enumerate(names)
    ]
    return objects, [files[sha] for sha in names], remarks


def manifest_of(request: DatasetRequest, objects: Sequence[DatasetObject]) -> dict[str, Any]:
    """What the manifest of a data set says."""
    return {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "order": request.to_document(),
        "objects": [asdict(item) for item in objects],
    }


def divide(hashes: Collection[str], split: Sequence[float]) -> dict[str, str]:
    """The split of every object, by its hash: sorted by it and cut at the shares."""
    bounds = [round(len(hashes) * sum(split[: k + 1]) / sum(split)) for k in range(3)]
    return {
        sha: next(s for s, bound in zip(SPLITS, bounds, strict=True) if i < bound)
        for i, sha in enumerate(sorted(hashes))
    }


def _files(paths: Iterable[Path]) -> Iterable[Path]:
    for path in paths:
        if path.is_dir():
            yield from sorted(file for file in path.rglob("*") if file.suffix.lower() in SUFFIXES)
        elif path.is_file():
            yield path
        else:
            raise DatasetError(f"{path} does not exist.")
