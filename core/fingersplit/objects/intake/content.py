"""What a file is before its format counts: pointers to files elsewhere, archives, pages, encodings, marks."""

from fingersplit.errors import ObjectFileError

__all__ = ["checked_content", "or_other_format"]

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_ENCODINGS = {
    b"\xff\xfe\0\0": "UTF-32",
    b"\0\0\xfe\xff": "UTF-32",
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
}
_PACKED = {
    b"\x1f\x8b": "gzip",
    b"PK\x03\x04": "zip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\0": "xz",
    b"7z\xbc\xaf": "7-Zip",
    b"(\xb5/\xfd": "zstd",
}
_TEXT = ("obj", "off", "ply", "stl", "pcd")
"""Formats that are, or may be, text."""
_BEGIN_WITH_A_WORD = ("off", "ply", "pcd")
"""Those that blank lines may stand before; a binary STL may begin with blanks of its own."""
_END_OF_TEXT = b"\0\x1a"
"""What old systems put behind the last line of a text."""
_OTHERS = {
    b"glTF": ("GLB", "glb"),
    b"ply\n": ("PLY", "ply"),
    b"ply\r": ("PLY", "ply"),
    b"OFF": ("OFF", "off"),
    b"solid": ("STL", "stl"),
    b"# .PCD": ("PCD", "pcd"),
    b"v ": ("OBJ", "obj"),
    b"{\\rtf": ("a formatted text (RTF)", None),
    b"{": ("JSON, such as glTF as text or an error message", None),
    b"<?xml": ("XML, such as COLLADA, X3D or an error message", None),
    b"ISO-10303-21": ("STEP", None),
    b"%PDF": ("PDF", None),
    b"#VRML": ("VRML", None),
    b"Kaydara FBX": ("FBX", None),
    b"\x89PNG": ("a PNG picture", None),
    b"\xff\xd8\xff": ("a JPEG picture", None),
}
"""How files of other formats begin, what these are called, and their suffix where they are read."""
_HEAD = 1024  # bytes that tell
_CONTROL_CHARACTERS = bytes(set(range(32)) - set(b"\t\n\v\f\r"))


def checked_content(data: bytes, file_type: str) -> bytes:
    """The bytes of a file without a byte order mark, the lines of a text with LF or CRLF at their end.

    Args:
        data: The file's bytes.
        file_type: Format that it is said to have, without a dot.

    Raises:
        ObjectFileError: It is empty, a pointer of a large-file store, an archive, a web page, or text in an encoding
            that no format of ours is written in.
    """
    kind = file_type.upper()
    if not data or data.isspace():
        raise ObjectFileError("empty", f"The file is empty ({len(data)} bytes); it should hold an object as {kind}.")
    if data.startswith(_BYTE_ORDER_MARK):
        data = data[len(_BYTE_ORDER_MARK) :]
    if file_type in _BEGIN_WITH_A_WORD:
        data = data.lstrip()
    head = data[:_HEAD].lstrip()
    if head.startswith(b"version https://git-lfs.github.com/spec/"):
        store = "Git LFS; get the file with 'git lfs pull'"
        raise ObjectFileError("pointer", f"This is a pointer of a large-file store ({store}), not the file itself.")
    if len(data) < _HEAD and b"annex/objects/" in head and head.startswith((b"/annex", b"../", b".git/")):
        store = "git-annex; get the file with 'git annex get'"
        raise ObjectFileError("pointer", f"This is a pointer of a large-file store ({store}), not the file itself.")
    encoding = _encoding(data[:_HEAD]) if file_type in _TEXT else None
    if encoding:
        raise ObjectFileError("wrong_encoding", f"The file is text in {encoding}; save it as UTF-8 or ASCII.")
    for mark, archive in _PACKED.items():
        if data.startswith(mark) and not (archive == "zip" and file_type == "npz"):
            raise ObjectFileError("packed", f"The file is packed ({archive}), not plain {kind}; unpack it first.")
    if head[:14].lower().startswith((b"<!doctype html", b"<html")):
        raise ObjectFileError("web_page", f"The file is a web page, not {kind}: the download went wrong.")
    return _with_lines(data, file_type) if file_type in _TEXT else data


def or_other_format(refusal: ObjectFileError, data: bytes, file_type: str) -> ObjectFileError:
    """A parser's refusal, or that the file is of another format than it is said to have.

    Args:
        refusal: What the parser found wrong.
        data: The file's bytes.
        file_type: Format that it is said to have, without a dot.
    """
    head = data[:_HEAD].lstrip()
    for mark, (what, suffix) in _OTHERS.items():
        if head.startswith(mark) and suffix != file_type:
            cloud = ", or the cloud as PLY, PCD or NPZ" if file_type in ("pcd", "npz") else ""
            export = f"export the mesh as STL, OBJ, PLY, OFF or GLB{cloud}"
            right = f"give it the suffix .{suffix}" if suffix else export
            return ObjectFileError("other_format", f"The file is {what}, not {file_type.upper()}: {right}.")
    return refusal


def _encoding(head: bytes) -> str | None:
    """The encoding of a text in 16 or 32 bits, by its mark or because every second byte is zero; None for others."""
    for mark, encoding in _ENCODINGS.items():
        if head.startswith(mark):
            return encoding
    even, odd = head[::2], head[1::2]
    for letters, zeros in ((even, odd), (odd, even)):
        if len(zeros) > 8 and not zeros.strip(b"\0") and b"\0" not in letters:
            return "UTF-16"
    return None


def _with_lines(data: bytes, file_type: str) -> bytes:
    """A text without marks of old systems: lines that end in CR alone, and NUL or Ctrl-Z behind the last one.

    Files that are binary, or say so, stay as they are.
    """
    head = data[:_HEAD].rstrip(_END_OF_TEXT)
    if b"binary" in head or head.translate(None, _CONTROL_CHARACTERS) != head:
        return data
    if data[-1:] in (b"\0", b"\x1a") and file_type != "stl":  # text in STL ends with a word of its own
        data = data.rstrip(_END_OF_TEXT)
    return data.replace(b"\r", b"\n") if b"\r" in head and b"\n" not in data else data
