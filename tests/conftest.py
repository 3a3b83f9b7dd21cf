"""What every test may ask for: real meshes when they are there, the Barrett hand, small prepared objects."""

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import hypothesis
import pytest

from fingersplit.hands import Hand, load_hand
from fingersplit.objects.loading import load_object
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object

hypothesis.settings.register_profile("reproducible", derandomize=True, deadline=None, database=None)
hypothesis.settings.load_profile("reproducible")

REPOSITORY = Path(__file__).parents[1]
TESTS = REPOSITORY / "tests"

TOGETHER = ("client", "browser")
"""Folders whose files share a service, so that one process runs all of each."""

LONG = (
    *("client/", "browser/", "service/test_cluster", "service/test_whole_service", "service/test_contract"),
    *("bench/test_command", "service/test_faults", "core/cli/test_stored_results", "core/execution/test_execution"),
    *(
        "docs/test_blocks",
        "docs/test_site",
        "service/test_attacks",
        "core/hands/test_draft",
        "core/dataset/test_running",
    ),
    *("service/test_follow_ups", "core/verification/test_pick", "packaging/test_extras", "core/cli/test_cli"),
)
"""What takes longest; it comes first, so that no process is left alone with one of these in the end."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    starts = tuple(str(TESTS / name) for name in LONG)
    items.sort(key=lambda item: next((n for n, start in enumerate(starts) if str(item.path).startswith(start)), 99))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Half as many processes again as there are cores: tests of services wait for other processes much of the time."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores + cores // 2


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Hand out files, and the folders of ``TOGETHER`` as a whole."""
    if config.getoption("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class Shared(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            _, folder, *_ = Path(nodeid.partition("::")[0]).parts
            return folder if folder in TOGETHER else super()._split_scope(nodeid)

    return Shared(config, log)


def find_objects_folder() -> Path | None:
    configured = os.environ.get("FINGERSPLIT_OBJECTS")
    if configured:
        return Path(configured)
    beside = REPOSITORY.parent / "shared" / "objects"
    return beside if beside.is_dir() else None


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test that asks for ``every_object`` once for each real mesh, or each parametric one where there is none."""
    if "every_object" in metafunc.fixturenames:
        folder = find_objects_folder()
        names = sorted(path.stem for path in folder.glob("*.ply")) if folder else sorted(PARAMETRIC_OBJECTS)
        metafunc.parametrize("every_object", names, indirect=True, scope="module")


@pytest.fixture(scope="session")
def objects_folder() -> Path | None:
    """Folder of the real meshes: FINGERSPLIT_OBJECTS, else the one beside the repository, else None."""
    return find_objects_folder()


@pytest.fixture(scope="session")
def barrett() -> Hand:
    return load_hand("barrett")


@pytest.fixture(scope="session")
def prepared() -> Callable[[str], ObjectModel]:
    """Prepared parametric objects by name, each made once."""

    @cache
    def prepare(name: str) -> ObjectModel:
        return prepare_object(PARAMETRIC_OBJECTS[name](), name)

    return prepare


@pytest.fixture(scope="module")
def every_object(
    request: pytest.FixtureRequest, objects_folder: Path | None, prepared: Callable[[str], ObjectModel]
) -> ObjectModel:
    """One after the other, every real object, or every parametric one."""
    if objects_folder is None:
        return prepared(request.param)
    return load_object(objects_folder / f"{request.param}.ply")
