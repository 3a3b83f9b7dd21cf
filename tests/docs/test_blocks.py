"""What the documentation shows is run: blocks of the library as programs, commands by the command line itself."""

import os
import subprocess
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from code_blocks import FOLLOWED, PAGES, ROOT, blocks, commands
from fingersplit.cli.main import add_commands, app

RUN = {"plan", "verify", "export", "formats", "sources", "settings"}
"""Commands that are run; of others, which serve, measure or take long, the options are checked."""
SCENE = {"--table", "--scene"}
"""Options with which kernels for scenes are compiled; the tests of scenes run these."""
LIBRARY = [
    one
    for one in blocks("python")
    if "fingersplit_client" not in one.text and one.page not in {"docs/extending.md", *FOLLOWED}
]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder in which the blocks find what they name."""
    folder = tmp_path_factory.mktemp("documentation")
    (folder / "examples").symlink_to(ROOT / "examples")
    before = Path.cwd()
    os.chdir(folder)
    yield folder
    os.chdir(before)


def test_there_are_blocks_of_each_kind():
    assert len(PAGES) > 10
    assert len(LIBRARY) >= 3
    assert {one.page for one in blocks("python")} >= FOLLOWED
    assert len(commands("fingersplit")) >= 10
    assert len(commands("curl")) >= 4


@pytest.mark.parametrize("page", sorted({one.page for one in LIBRARY}))
def test_the_python_of_a_page_runs(place, page, capsys):
    names = {}
    for block in LIBRARY:
        if block.page == page:
            exec(compile(block.text, str(block), "exec"), names)
    assert capsys.readouterr().out


def test_the_commands_of_all_pages_run(place):
    add_commands()
    group = typer.main.get_command(app)
    done = set[tuple[str, ...]]()
    for where, (_, *words) in commands("fingersplit"):
        if tuple(words) in done:
            continue
        done.add(tuple(words))
        if (
            words[0] in RUN
            and SCENE.isdisjoint(words)
            and all(Path(word).exists() for word in words if word.endswith((".ply", ".npz")))
        ):
            finished = CliRunner().invoke(app, words)
            assert finished.exit_code == 0, f"{where}: {finished.output}"
        else:
            _parse(group, words, where)


def _parse(group, words, where):
    """Whether all commands and options are known, whatever the values."""
    command = group
    name = "fingersplit"
    while hasattr(command, "commands"):
        name, *words = words
        assert name in command.commands, f"{where}: there is no command {name!r}"
        command = command.commands[name]
    known = {option for one in command.params for option in (*one.opts, *one.secondary_opts)} | {"--help"}
    for word in words:
        assert not word.startswith("--") or word.partition("=")[0] in known, f"{where}: {word} is no option of {name}"


@pytest.mark.parametrize(("where", "words"), commands("make"))
def test_the_targets_of_make_exist(where, words):
    subprocess.run(["make", "-n", *words[1:]], cwd=ROOT, check=True, capture_output=True)
