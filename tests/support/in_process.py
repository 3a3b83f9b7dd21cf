"""The ``fingersplit`` program within this process: what a start costs is paid once, what it prints is kept apart.

That the installed program starts at all is for the tests that start a process.
"""

import io
import sys
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from subprocess import CompletedProcess
from unittest.mock import patch

from fingersplit.cli import main

__all__ = ["run_program"]


def run_program(*arguments: object, cwd: Path, program: Callable[[], object] = main) -> CompletedProcess[str]:
    """Run a command in a folder, of the whole program or of the client's; its exit code and all that it printed."""
    words = ["fingersplit", *map(str, arguments)]
    out, err = _Pipe(), _Pipe()
    code = 0
    with chdir(cwd), patch.object(sys, "argv", words), redirect_stdout(out), redirect_stderr(err):
        try:
            program()
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return CompletedProcess(words, code, out.said(), err.said())


class _Pipe(io.TextIOWrapper):
    """A text stream over memory, as that of a pipe: it is no terminal and has bytes below it."""

    def __init__(self) -> None:
        self._kept = io.BytesIO()
        super().__init__(self._kept, encoding="utf-8", write_through=True)

    def said(self) -> str:
        """All that was written."""
        self.flush()
        return self._kept.getvalue().decode()
