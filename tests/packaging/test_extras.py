"""Optional packages: without them a mesh is planned for, and what needs one says what to install."""

import json
import subprocess
import sys

import pytest

BLOCK = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {packages}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Missing())
"""
FORMAT = """
import pathlib, tempfile
import fingersplit as fs
from fingersplit.objects.parametric import box
path = pathlib.Path(tempfile.mkdtemp()) / {name!r}
path.write_bytes({content!r})
fs.import_parallel_grasps(path, fs.prepare_object(box()))
"""
SHAPE = """
from fingersplit import Mesh, PointCloud, decompose, prepare_object
from fingersplit.objects.parametric import box, l_bracket
{1}({0})
"""
OPTIONAL = {
    "rerun": ("recording", "import fingersplit.recording.run_recording"),
    "matplotlib": ("pictures", "import fingersplit.recording.pictures"),
    "h5py": ("formats", FORMAT.format(name="grasps.h5", content=b"\x89HDF\r\n\x1a\n")),
    "yaml": ("formats", FORMAT.format(name="grasps.yaml", content=b"format: isaac_grasp")),
    "skimage": ("clouds", SHAPE.format("PointCloud(box().trimesh.sample(2000, seed=0), None, None)", "prepare_object")),
    "vhacdx": ("verify", SHAPE.format("l_bracket()", "decompose")),
}


def run(code: str, packages: set[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", BLOCK.format(packages=packages) + code], capture_output=True, text=True, check=False
    )


TRIED = """
import json
said = {{}}
for package, code in {codes}.items():
    try:
        exec(code, {{}})
    except Exception as error:
        said[package] = str(error)
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def said() -> dict[str, str]:
    """What is said where each of the packages is missing, by package; one process without any of them tells all."""
    codes = {package: code for package, (_, code) in OPTIONAL.items()}
    told: dict[str, str] = json.loads(run(TRIED.format(codes=codes), set(OPTIONAL)).stdout)
    return told


@pytest.mark.parametrize("package", OPTIONAL)
def test_what_needs_a_missing_package_says_what_to_install(package, said):
    assert f"pip install 'fingersplit[{OPTIONAL[package][0]}]'" in said[package]


def test_a_mesh_is_planned_for_without_any(tmp_path):
    code = """
import fingersplit as fs
from fingersplit.objects.parametric import box
box().trimesh.export({path!r})
result = fs.plan(fs.load_object({path!r}, unit="m"), fs.load_hand("barrett"), starts=4, seed=1, top_k=1)
print(len(result.grasps))
"""
    shown = run(code.format(path=str(tmp_path / "box.stl")), {*OPTIONAL, "pypcd4", "PIL", "typer", "rich"})
    assert (shown.returncode, shown.stdout.strip()) == (0, "1"), shown.stderr
