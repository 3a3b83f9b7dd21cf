"""Warming up leaves no kernel to be compiled by the first request that needs it."""

import subprocess
import sys

PROGRAM = """
import ast, importlib
from pathlib import Path

import fingersplit
from fingersplit.cli.warming import compile_kernels
from fingersplit.hands.hand import load_hand

compile_kernels([load_hand("barrett")])
called = set()
for file in Path(fingersplit.__file__).parent.rglob("*.py"):
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").endswith("_kernel"):
            if not file.name.endswith("_kernel.py"):
                called.update((node.module, name.name) for name in node.names)
kernels = {name: getattr(importlib.import_module(name[0]), name[1]) for name in called}
kernels = {name: one for name, one in kernels.items() if hasattr(one, "signatures")}
print(len(kernels), sorted(name for name, one in kernels.items() if not one.signatures))
"""


def test_every_kernel_that_python_calls_is_warm():
    ended = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    count, cold = ended.stdout.split(maxsplit=1)
    assert int(count) > 40
    assert cold.strip() == "[]"
