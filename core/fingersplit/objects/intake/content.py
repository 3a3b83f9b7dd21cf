"""What a file is before its format counts: pointers to files elsewhere, archives, pages, encodings, marks."""

from fingersplit.errors import ObjectFileError

__all__ = ["checked_content"]

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
_HEAD = 1024  # bytes that tell


def checked_content(data: bytes, file_type: str) -> bytes:
    """The bytes of a file without a byte order mark.

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
    head = data[:_HEAD].lstrip()
    if head.startswith(b"version https://git-lfs.github.com/spec/"):
        store = "Git LFS; get the file with 'git lfs pull'"
        raise ObjectFileError("pointer", f"This is a pointer of a large-file store ({store}), not the file itself.")
    if len(data) < _HEAD and b"annex/objects/" in head and head.startswith((b"/annex", b"../", b".git/")):
        store = "git-annex; get the file with 'git annex get'"
        raise ObjectFileError("pointer", f"This is a pointer of a large-file store ({store}), not the file itself.")
    for mark, encoding in _ENCODINGS.items():
        if data.startswith(mark) and file_type in ("obj", "off", "ply", "stl", "pcd"):
            raise ObjectFileError("wrong_encoding", f"The file is text in {encoding}; save it as UTF-8 or ASCII.")
    for mark, archive in _PACKED.items():
        if data.startswith(mark) and not (archive == "zip" and file_type == "npz"):
            raise ObjectFileError("packed", f"The file is packed ({archive}), not plain {kind}; unpack it first.")
    if head[:14].lower().startswith((b"<!doctype html", b"<html")):
        raise ObjectFileError("web_page", f"The file is a web page, not {kind}: the download went wrong.")
    return data
