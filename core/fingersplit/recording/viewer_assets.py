"""rerun's web viewer as files to serve: the build that belongs to the installed package, and so to its recordings."""

import gzip
import os
import socket
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

from fingersplit.errors import ViewerError
from fingersplit.extras import extra

__all__ = [
    "VIEWER_FILES",
    "keep_compressed",
    "set_up_viewer",
    "viewer_folder",
    "viewer_is_set_up",
    "viewers_folder",
]

VIEWER_FILES = ("re_viewer.js", "re_viewer_bg.wasm")
"""The script and the program it loads; kept with the suffix ``.gz``."""
START_WITHIN = 30.0
"""[s]"""
LEVEL = 6
"""Of compression; 9 takes thrice the time for one percent."""


def viewers_folder() -> Path:
    """Where viewers are kept: ``FINGERSPLIT_VIEWER_DIR`` when that is set, else below the user's cache folder."""
    chosen = os.environ.get("FINGERSPLIT_VIEWER_DIR")
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fingersplit"
    return Path(chosen) if chosen else cache


def viewer_folder() -> Path:
    """Where the viewer's files are kept, named after rerun's version."""
    return viewers_folder() / f"rerun-viewer-{version('rerun-sdk')}"


def viewer_is_set_up() -> bool:
    """Whether all files are there."""
    return all((viewer_folder() / f"{name}.gz").exists() for name in VIEWER_FILES)


def set_up_viewer() -> Path:
    """Take the viewer out of the installed rerun package, compress it and keep it; a few seconds, once a version.

    The package hands its viewer out over HTTP only, so it serves it on a loopback port until this process ends.

    Returns:
        The folder.

    Raises:
        ViewerError: The package does not serve its viewer, or the folder cannot be written.
    """
    with extra("recording"):
        import rerun as rr  # only where a recording is written or its viewer is needed

    folder = viewer_folder()
    if viewer_is_set_up():
        return folder
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    rr.start_web_viewer_server(port=port)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in VIEWER_FILES:
            keep_compressed(folder / f"{name}.gz", _download(f"http://127.0.0.1:{port}/{name}"))
    except OSError as error:
        raise ViewerError(f"The viewer cannot be kept in {folder}: {error}. Set FINGERSPLIT_VIEWER_DIR.") from error
    return folder


def _download(address: str) -> bytes:
    deadline = time.monotonic() + START_WITHIN
    while True:
        try:
            with urlopen(address, timeout=START_WITHIN) as answer:
                return bytes(answer.read())
        except URLError as error:
            if time.monotonic() > deadline:
                raise ViewerError(f"rerun does not serve its viewer at {address}: {error.reason}.") from error
            time.sleep(0.05)


def keep_compressed(path: Path, data: bytes) -> None:
    """Compress and rename into place: another process sees the whole file or none."""
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as staged:
        staged.write(gzip.compress(data, LEVEL, mtime=0))
    Path(staged.name).chmod(0o644)
    Path(staged.name).replace(path)
