"""Ten thousand damaged files of every format: each ends in an object or a refusal, in bounded time and memory."""

import json
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

pytestmark = pytest.mark.campaign

FILES = 10_000
FORMS = ("stl", "stl_ascii", "obj", "mesh_ply", "mesh_ply_ascii", "off", "glb")
CLOUDS = ("ascii", "binary", "binary_compressed", "ply", "ply_ascii", "npz")
BATCH = 200

READ_DAMAGED = """
import json, pathlib, resource, signal, sys
from collections import Counter
import numpy as np
from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake import read_bytes
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from mesh_bytes import ball, cloud, mutated

form, seed, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
if form in ("ascii", "binary", "binary_compressed", "ply", "ply_ascii", "npz"):
    data, file_type = cloud(form), {"npz": "npz"}.get(form, "ply" if "ply" in form else "pcd")
else:
    file_type = form.removeprefix("mesh_").removesuffix("_ascii")
    data = ball(file_type, encoding="ascii") if form == "mesh_ply_ascii" else ball(form.removeprefix("mesh_"))
prepare_object(box())  # so that everything is loaded before memory is bounded
present = int(pathlib.Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (present + 1_000_000_000,) * 2)
random, outcomes = np.random.default_rng(seed), Counter()
for number in range(count):
    damaged = mutated(data, random)
    signal.setitimer(signal.ITIMER_PROF, 10)  # s of processor time; then the process ends
    try:
        shape, _ = read_bytes(damaged, file_type)
        if outcomes["object"] % 10 == 0:
            prepare_object(shape)
        outcomes["object"] += 1
    except ObjectFileError as error:
        assert str(error).endswith(".") and len(str(error)) < 500, error
        outcomes[error.code] += 1
    signal.setitimer(signal.ITIMER_PROF, 0)
print(json.dumps(outcomes))
"""


def run_batch(form: str, seed: int, count: int) -> Counter[str]:
    support = str(Path(__file__).parents[2] / "support")
    code = f"import sys; sys.path.insert(0, {support!r})\n{READ_DAMAGED}"
    command = [sys.executable, "-c", code, form, str(seed), str(count)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=10 * count, check=False)
    assert done.returncode == 0, f"{form}, seed {seed}: ended with {done.returncode}\n{done.stderr[-2000:]}"
    return Counter(json.loads(done.stdout))


@pytest.mark.parametrize("form", [*FORMS, *CLOUDS])
def test_damaged_files_end_in_an_object_or_a_refusal(form):
    share = -(-FILES // len([*FORMS, *CLOUDS]))
    counts = [min(BATCH, share - start) for start in range(0, share, BATCH)]
    with ThreadPoolExecutor(2) as pool:
        outcomes = sum(pool.map(run_batch, [form] * len(counts), range(len(counts)), counts), Counter())
    assert sum(outcomes.values()) == share
    assert len(outcomes) > (0 if form == "npz" else 2), outcomes  # of zip files, checksums find nearly all damage
