"""Code blocks of the documentation, page by page."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

__all__ = ["FOLLOWED", "PAGES", "Block", "blocks", "commands"]

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "clients" / "python" / "README.md", *(ROOT / "docs").glob("*.md")])
FOLLOWED = {"docs/datasets.md", "docs/depth_camera.md", "docs/failed_run.md"}
"""Tutorials whose blocks build on each other; their library and commands are run in order, as a reader does."""


@dataclass(frozen=True)
class Block:
    """One fenced block: its page and line, its language and its text."""

    page: str
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def blocks(*languages: str) -> list[Block]:
    """All blocks in one of these languages, in the order of the pages."""
    found = []
    for page in PAGES:
        text = page.read_text()
        for match in re.finditer(r"^```(\w+)\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
            if match[1] in languages:
                line = text.count("\n", 0, match.start()) + 1
                found.append(Block(str(page.relative_to(ROOT)), line, match[1], match[2]))
    return found


def commands(program: str) -> list[tuple[str, list[str]]]:
    """Where a program is called in blocks for a shell, and the call in words, without comments."""
    found = []
    for block in blocks("sh", "console"):
        for line in block.text.replace("\\\n", " ").splitlines():
            if block.language == "console" and not line.startswith("$ "):
                continue  # what the command before it printed
            words = shlex.split(line.removeprefix("$ "), comments=True)
            if words and Path(words[0]).name == program:
                found.append((str(block), words))
    return found
