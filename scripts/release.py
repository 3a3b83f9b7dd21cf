"""Prepare a release: ``python scripts/release.py 0.2.0`` sets the version, dates the changelog, commits and tags.

Nothing is pushed or uploaded; ``git push --follow-tags`` does that once the commit has been looked at.
"""

import re
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSION = re.compile(r"\d+\.\d+\.\d+")
UNRELEASED = "## Unreleased\n"


def main(version: str, root: Path = ROOT) -> None:
    """Make the release commit and its tag.

    Raises:
        SystemExit: The version is none or not above the current one, the tree is not clean, or nothing has changed.
    """
    project = root / "core" / "pyproject.toml"
    current = re.search(r'^version = "(.+)"$', project.read_text(), re.MULTILINE)
    if not current or not VERSION.fullmatch(version) or _numbers(version) <= _numbers(current[1]):
        sys.exit(
            f"{version!r} is no version above {current[1] if current else 'the current one'}; give one like 1.2.3."
        )
    if _git(root, "status", "--porcelain"):
        sys.exit("The working tree has changes that are not committed; commit or stash them first.")
    changelog = root / "CHANGELOG.md"
    text = changelog.read_text()
    before, heading, after = text.partition(UNRELEASED)
    if not heading or after.lstrip().startswith("## "):
        sys.exit("CHANGELOG.md lists no changes under '## Unreleased'; say there what the release brings.")
    changelog.write_text(f"{before}{UNRELEASED}\n## {version} ({datetime.now(UTC):%Y-%m-%d})\n{after}")
    for file in (project, root / "service" / "pyproject.toml", root / "benchmarks" / "pyproject.toml"):
        file.write_text(_with_version(file.read_text(), current[1], version))
    _git(root, "commit", "-qam", f"Release {version}")
    _git(root, "tag", "-a", f"v{version}", "-m", f"Fingersplit {version}")
    print(f"Committed and tagged v{version}; look at it, then run: git push --follow-tags")


def _with_version(text: str, current: str, version: str) -> str:
    """The version itself, and the pins of our own distributions."""
    return text.replace(f'version = "{current}"', f'version = "{version}"').replace(f"=={current}", f"=={version}")


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(map(int, version.split(".")))


def _git(root: Path, *arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=root, check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python scripts/release.py VERSION")
    main(sys.argv[1])
