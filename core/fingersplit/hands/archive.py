"""Archives of hands that were uploaded: refused with a reason before anything in them is compiled."""

import io
import re
import stat
import zipfile
from pathlib import Path, PurePosixPath
from xml.parsers import expat

from fingersplit.errors import HandError

__all__ = ["unpack"]

MAX_FILES, MAX_FILE_BYTES, MAX_BYTES, MAX_RATIO = 500, 64 << 20, 256 << 20, 200
"""Most files of an archive, most bytes of one and of all [B], and most times that a file may grow when unpacked."""

MAX_DEPTH, MAX_ELEMENTS = 100, 20_000
"""Deepest nesting and most elements of a model file."""

SUFFIXES = {
    ".xml",
    ".urdf",
    ".mjcf",
    ".toml",
    ".stl",
    ".obj",
    ".mtl",
    ".msh",
    ".png",
    ".jpg",
    ".jpeg",
    ".md",
    ".txt",
    "",
}
_NAME = re.compile(r"[A-Za-z0-9_\-.+, ()]{1,120}")
_PATH_ATTRIBUTES = {"file", "filename", "fileright", "fileup", "filedown", "fileleft", "filefront", "fileback"}
_FOLDER_ATTRIBUTES = {"meshdir", "texturedir", "assetdir"}
_REFUSED_ELEMENTS = {"plugin", "extension", "flexcomp", "composite", "hfield", "skin", "flex", "replicate"}


def unpack(data: bytes, folder: Path) -> None:
    """Write the files of a zip below ``folder``, which must not exist.

    Raises:
        HandError: The archive is broken, too large, names files outside of itself, or a model in it does.
    """
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        raise HandError("The archive is no zip file, or is damaged.") from error
    members = [member for member in archive.infolist() if not member.filename.endswith("/")]
    if len(members) > MAX_FILES:
        raise HandError(f"The archive holds {len(members)} files; at most {MAX_FILES} are taken.")
    paths = [_path(member) for member in members]
    if len({str(path).lower() for path in paths}) < len(paths):
        raise HandError("Two files of the archive have the same name.")
    contents: dict[PurePosixPath, bytes] = {}
    left = MAX_BYTES
    for member, path in zip(members, paths, strict=True):
        contents[path] = _read(archive, member, path, left)
        left -= len(contents[path])
    for path, content in contents.items():
        if path.suffix.lower() in {".xml", ".urdf", ".mjcf"}:
            _check_model(content, path, set(contents))
    for path, content in contents.items():
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
    folder.mkdir(parents=True, exist_ok=True)


def _check_model(content: bytes, path: PurePosixPath, files: set[PurePosixPath]) -> None:
    """Refuse a model file that declares entities, nests or grows without end, or names files outside of ``files``.

    Raises:
        HandError: It does.
    """
    parser = expat.ParserCreate()
    depth, count = 0, 0

    def refuse_declaration(*_: object) -> None:
        raise HandError(f"{path} declares a document type or entities; remove them.")

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_DEPTH or count > MAX_ELEMENTS:
            raise HandError(f"{path} has more than {MAX_ELEMENTS} elements, or nests deeper than {MAX_DEPTH}.")
        if name in _REFUSED_ELEMENTS:
            raise HandError(f"{path} has a <{name}>, which an uploaded hand may not; remove it.")
        for key, value in attributes.items():
            if key in _PATH_ATTRIBUTES or key in _FOLDER_ATTRIBUTES:
                _check_reference(path, name, key, value, files)

    def end(_: str) -> None:
        nonlocal depth
        depth -= 1

    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse_declaration
    parser.StartElementHandler, parser.EndElementHandler = start, end
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise HandError(
            f"{path} is not XML: it cannot be read from line {error.lineno}, column {error.offset + 1} on."
        ) from error


def _check_reference(path: PurePosixPath, element: str, key: str, value: str, files: set[PurePosixPath]) -> None:
    plain = value.split("://", 1)[1] if value.startswith(("package://", "model://")) else value
    place = PurePosixPath(plain.replace("\\", "/"))
    if "://" in plain or plain.startswith(("file:", "~")) or place.is_absolute() or re.match(r"[A-Za-z]:", plain):
        raise HandError(f"{path}: <{element} {key}={value[:80]!r}> is no path inside the archive.")
    inside = path.parent
    for part in place.parts:  # a step up is fine as long as it stays inside
        if part == ".." and inside == PurePosixPath("."):
            raise HandError(f"{path}: <{element} {key}={value[:80]!r}> leads out of the archive.")
        inside = inside.parent if part == ".." else inside / part
    if key in _PATH_ATTRIBUTES and place.name not in {file.name for file in files}:
        raise HandError(f"{path}: <{element} {key}={value[:80]!r}> names a file that the archive does not hold.")


def _path(member: zipfile.ZipInfo) -> PurePosixPath:
    name, mode = member.filename, member.external_attr >> 16
    shown = ascii(name[:80])
    if member.flag_bits & 0x1:
        raise HandError(f"{shown} in the archive is encrypted.")
    if mode and not stat.S_ISREG(mode) and stat.S_IFMT(mode):
        raise HandError(f"{shown} in the archive is a link or a device, not a file.")
    path = PurePosixPath(name)
    if path.is_absolute() or "\\" in name or ".." in path.parts or re.match(r"[A-Za-z]:", name):
        raise HandError(f"{shown} in the archive is no path inside it.")
    if (
        not path.parts
        or len(path.parts) > 8
        or any(not _NAME.fullmatch(part) or part != part.strip() for part in path.parts)
    ):
        raise HandError(f"{shown} in the archive is no plain file name: letters, digits, space and _-.+,() are.")
    if path.suffix.lower() not in SUFFIXES:
        raise HandError(f"{shown} in the archive is no model, mesh, texture or description; leave it out.")
    return path


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo, path: PurePosixPath, left: int) -> bytes:
    """The content of a member, never more than its limits, whatever its header says."""
    most = min(MAX_FILE_BYTES, left, MAX_RATIO * max(member.compress_size, 1) + (1 << 16))
    if member.file_size > most:
        raise HandError(
            f"{path} unpacks to {member.file_size} bytes; an archive may hold {MAX_BYTES}, a file {MAX_FILE_BYTES}."
        )
    try:
        with archive.open(member) as stream:
            content = stream.read(most + 1)
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OSError, EOFError, RuntimeError) as error:
        raise HandError(
            f"{path} cannot be read from the archive: it is damaged, encrypted or packed in an unusual way."
        ) from error
    except Exception as error:  # zlib.error, lzma.LZMAError and their like share no root
        raise HandError(f"{path} cannot be unpacked: its data are damaged.") from error
    if len(content) > most:
        raise HandError(f"{path} unpacks to more than {most} bytes.")
    return content
