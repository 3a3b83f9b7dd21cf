"""What workers run when files were added: the real functions, with more folders on the paths of packages.

The module is imported by worker processes too; ``FINGERSPLIT_TEST_FILES`` names the folder with the added files.
"""

import importlib
import os
from dataclasses import replace
from pathlib import Path

from fingersplit_service.jobs.worker_functions import WarmUpReport, WorkerFunctions, _catalogs

ADDED = "FINGERSPLIT_TEST_FILES"


def warm() -> WarmUpReport:
    """Add the files, and report one hand; kernels compile or load when they are first called."""
    from fingersplit.hands.hand import load_hand

    added = Path(os.environ[ADDED])
    for folder in {file.parent for file in added.rglob("*.py")}:
        package = importlib.import_module(".".join(folder.relative_to(added).parts))
        package.__path__.append(str(folder))
    return WarmUpReport([load_hand("barrett").to_document()], False, _catalogs())


FUNCTIONS = replace(WorkerFunctions(), warm=warm)
