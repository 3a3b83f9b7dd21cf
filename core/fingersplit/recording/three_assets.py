"""three.js as a file to serve: the build that trimesh, which is installed and checked by hash, carries for its viewer.

Nothing is downloaded and no other package manager is needed. It is a script that defines ``THREE``.
"""

import re
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from fingersplit.errors import ViewerError
from fingersplit.recording.viewer_assets import keep_compressed, viewers_folder

__all__ = ["THREE_FILE", "set_up_three", "three_folder"]

THREE_FILE = "three.js"
"""Kept with the suffix ``.gz``."""
_ARCHIVE, _PAGE = "resources/templates/viewer.zip", "viewer.html.template"
_SCRIPT = re.compile(r"/\*\*\s*\* @license\s.*?Three\.js Authors.*?\*/\s*![^\n]+\n", re.DOTALL)


def three_folder() -> Path:
    """Where the script is kept, named after the version of the package that it comes from."""
    return viewers_folder() / f"three-{version('trimesh')}"


def set_up_three() -> Path:
    """Take three.js out of the installed trimesh package and keep it compressed; a moment, once a version.

    Returns:
        The folder.

    Raises:
        ViewerError: The package carries no three.js that can be told apart, or the folder cannot be written.
    """
    folder = three_folder()
    if (folder / f"{THREE_FILE}.gz").exists():
        return folder
    try:
        with ZipFile(_package() / _ARCHIVE) as archive:
            page = archive.read(_PAGE).decode()
    except (OSError, KeyError, BadZipFile, UnicodeDecodeError) as error:
        raise ViewerError(f"trimesh {version('trimesh')} carries no viewer to take three.js from: {error}.") from error
    script = _SCRIPT.search(page)
    if script is None:
        raise ViewerError(f"The viewer of trimesh {version('trimesh')} holds no three.js as a script of its own.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        keep_compressed(folder / f"{THREE_FILE}.gz", script[0].encode())
    except OSError as error:
        raise ViewerError(f"three.js cannot be kept in {folder}: {error}. Set FINGERSPLIT_VIEWER_DIR.") from error
    return folder


def _package() -> Path:
    """The folder of trimesh, which takes seconds to import."""
    spec = find_spec("trimesh")
    if spec is None or not spec.submodule_search_locations:
        raise FileNotFoundError("it is not installed as files")
    return Path(spec.submodule_search_locations[0])
