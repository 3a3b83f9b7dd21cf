"""Distributions: one version number, one licence, complete metadata, and an import that costs nothing."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from fingersplit.errors import FingersplitError, MissingExtraError
from fingersplit.extras import extra

REPOSITORY = Path(__file__).parents[2]
DISTRIBUTIONS = ("core", "service", "clients/python", "benchmarks")
VERSION = tomllib.loads((REPOSITORY / "core" / "pyproject.toml").read_text())["project"]["version"]


def project(folder: str) -> dict:
    return tomllib.loads((REPOSITORY / folder / "pyproject.toml").read_text())


@pytest.mark.parametrize("folder", DISTRIBUTIONS)
def test_metadata_is_complete(folder):
    stated = project(folder)["project"]
    assert stated["license"] == "Apache-2.0"
    assert {"description", "authors", "keywords", "classifiers", "readme"} <= set(stated)
    assert (REPOSITORY / folder / stated["readme"]).read_text().startswith("# ")
    licence = (REPOSITORY / folder / "LICENSE").read_text()
    assert licence == (REPOSITORY / "LICENSE").read_text()
    assert "Apache License" in licence


@pytest.mark.parametrize("folder", DISTRIBUTIONS)
def test_there_is_one_version_number(folder):
    stated = project(folder)
    if folder != "core":
        assert "version" not in stated["project"]
        assert "version" in stated["project"]["dynamic"]
        path = REPOSITORY / folder / stated["tool"]["hatch"]["version"]["path"]
        assert path.resolve() == REPOSITORY / "core" / "pyproject.toml"
    pins = [d.partition("==")[2] for d in stated["project"]["dependencies"] if d.startswith("fingersplit")]
    assert set(pins) <= {VERSION}


def test_all_names_every_extra():
    extras = project("core")["project"]["optional-dependencies"]
    (everything,) = extras.pop("all")
    assert everything == f"fingersplit[{','.join(sorted(extras))}]"


def test_a_missing_package_is_named_with_its_extra():
    message = r"'no_such_package': pip install 'fingersplit\[recording\]'"
    with pytest.raises(MissingExtraError, match=message) as caught, extra("recording"):
        import no_such_package  # noqa: F401
    assert isinstance(caught.value, FingersplitError)
    assert isinstance(caught.value, ImportError)


def test_importing_the_package_loads_nothing_heavy():
    code = (
        "import sys, fingersplit; "
        "print(sorted({'numpy', 'numba', 'scipy', 'mujoco', 'trimesh', 'rerun', 'typer'} & set(sys.modules)))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "[]"
