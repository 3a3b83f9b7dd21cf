"""scripts/release.py: one version everywhere, a dated changelog, a commit and a tag, or a reason."""

import runpy
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILES = ("CHANGELOG.md", "core/pyproject.toml", "service/pyproject.toml", "benchmarks/pyproject.toml")
release = runpy.run_path(str(ROOT / "scripts" / "release.py"))["main"]


def git(root: Path, *arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=root, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    for name in FILES:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    (tmp_path / "CHANGELOG.md").write_text("# Changelog\n\n## Unreleased\n\n- Something new.\n\n## 0.1.0\n\n- First.\n")
    git(tmp_path, "init", "-q")
    git(tmp_path, "config", "user.name", "Releaser")
    git(tmp_path, "config", "user.email", "releaser@example.org")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "Begin")
    return tmp_path


def test_a_release_is_a_commit_and_a_tag(repository):
    release("9.0.0", repository)
    assert git(repository, "describe").strip() == "v9.0.0"
    assert git(repository, "status", "--porcelain") == ""
    changelog = (repository / "CHANGELOG.md").read_text()
    assert changelog.index("## Unreleased") < changelog.index("## 9.0.0 (") < changelog.index("- Something new.")
    texts = [(repository / name).read_text() for name in FILES[1:]]
    assert 'version = "9.0.0"' in texts[0]
    assert "fingersplit-client==9.0.0" in texts[1]
    assert "fingersplit[all]==9.0.0" in texts[2]


@pytest.mark.parametrize(
    ("version", "reason"), [("0.0.1", "no version above"), ("next", "no version above"), ("9.0", "no version above")]
)
def test_what_is_no_higher_version_is_refused(repository, version, reason):
    with pytest.raises(SystemExit, match=reason):
        release(version, repository)


def test_a_changed_tree_is_refused(repository):
    (repository / "CHANGELOG.md").write_text("changed")
    with pytest.raises(SystemExit, match="not committed"):
        release("9.0.0", repository)


def test_a_release_without_changes_is_refused(repository):
    release("9.0.0", repository)
    with pytest.raises(SystemExit, match="lists no changes"):
        release("9.0.1", repository)
