"""What every test may ask for: real meshes when they are there, the Barrett hand, small prepared objects."""

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

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


LONG_FILES = (
    *("bench/test_command", "service/test_cluster", "service/test_whole_service", "service/test_faults"),
    *("browser/test_review", "browser/test_accessibility", "browser/test_grasp_view", "core/dataset/test_running"),
    *("client/test_commands", "client/test_clients", "core/cli/test_stored_results", "service/test_contract"),
)
"""Files that take half a minute and more; they come first, so that no worker is left alone with one in the end."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    first = {Path(__file__).parent / f"{name}.py": place for place, name in enumerate(LONG_FILES)}
    items.sort(key=lambda item: first.get(item.path, len(first)))


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
