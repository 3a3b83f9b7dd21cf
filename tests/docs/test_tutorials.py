"""Tutorials that are followed from top to bottom: each block is run, and what a page shows is what is printed."""

import re
from pathlib import Path
from typing import get_args

import pytest

from code_blocks import FOLLOWED, ROOT, blocks
from fingersplit.result.verification import Reason
from fingersplit.splitting.termination import Termination
from in_process import run_program

SAVED = {"docs/failed_run.md": "shelf.json"}
"""Under which name the reader is told to save the JSON of a page."""


@pytest.mark.parametrize("page", sorted(FOLLOWED))
def test_a_page_can_be_followed(page, tmp_path, monkeypatch, capsys):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    names, shown = {}, 0
    for block in blocks("python", "console", "json"):
        if block.page != page or "fingersplit_client" in block.text:
            continue
        if block.language == "json":
            Path(SAVED[page]).write_text(block.text)
        elif block.language == "python":
            exec(compile(block.text, str(block), "exec"), names)
        else:
            shown += _follow(block)
    assert shown >= 2
    assert capsys.readouterr().out


def _follow(block):
    """Run the one command of a block; how many lines it shows that were compared."""
    command, *lines = block.text.replace("\\\n", " ").splitlines()
    words = command.removeprefix("$ fingersplit ").split()
    done = run_program(*words, cwd=Path.cwd())
    printed = done.stdout + done.stderr
    failed = any(line.startswith(("Error:", "None of")) for line in lines)
    assert bool(done.returncode) == failed, f"{block}: {printed}"
    for line in lines:
        missing = _words(line) - _words(printed)
        assert not missing, f"{block} shows {missing}, which is not printed: {printed}"
    return len(lines)


def _words(text):
    """The words of a text; numbers count as one word, since they may differ between machines."""
    return set(re.sub(r"-?\d[\d.,]*", "0", text).replace(".", " ").replace(",", " ").split())


def test_ends_and_reasons_of_a_failed_run_are_those_of_the_program():
    page = (ROOT / "docs" / "failed_run.md").read_text()
    named = set(re.findall(r"`(\w+)`", " ".join(re.findall(r"^\| (`[^|]+) \|", page, re.MULTILINE))))
    failures = {one.label for one in Termination if one.value >= 4 and not one.name.startswith("STOPPED")}
    assert named == failures | (set(get_args(Reason)) - {"held"})
