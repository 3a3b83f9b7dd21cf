"""Pictures of plans: real files, from a process without display or OpenGL."""

import json
import os
import struct
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.recording.stored import animate_stored, draw_stored, thumbnail_stored
from fingersplit.recording.traces_file import save_traces

DRAW = """
import sys
from pathlib import Path
from fingersplit.objects.parametric import cylinder
from fingersplit.recording.stored import draw_stored
draw_stored(Path(sys.argv[1]), cylinder(), 1, Path(sys.argv[2]))
maps = Path("/proc/self/maps")
loaded = maps.read_text() if maps.exists() else " ".join(sys.modules)
found = [name for name in ("libGL", "libEGL", "libOSMesa", "OpenGL") if name in loaded]
sys.exit(f"loaded {found}" if found else 0)
"""


@pytest.fixture(scope="module")
def traces(barrett, tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "traces.npz"
    planned = plan(prepare_object(cylinder(), "cylinder"), barrett, starts=8, top_k=2, seed=3)
    save_traces(planned, json.dumps(planned.to_document()), path)
    return path


def test_a_picture_comes_out_without_display_or_opengl(traces, tmp_path):
    png = tmp_path / "grasp.png"
    hidden = {"DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL", "PYOPENGL_PLATFORM"}
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    subprocess.run([sys.executable, "-c", DRAW, str(traces), str(png)], env=environment, check=True, timeout=120)
    data = png.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert width >= 1200
    assert height >= 400
    image = imread(png)
    thirds = np.array_split(image[..., :3], 3, axis=1)
    for third in thirds:
        assert np.ptp(third) > 0.5
        assert (third.min(axis=2) < 0.9).mean() > 0.05  # something is drawn on the white


def test_ranks_differ_and_a_missing_rank_is_an_error(traces, tmp_path):
    first, second = tmp_path / "1.png", tmp_path / "2.png"
    draw_stored(traces, cylinder(), 1, first)
    draw_stored(traces, cylinder(), 2, second)
    assert not np.array_equal(imread(first), imread(second))
    with pytest.raises(KeyError):
        draw_stored(traces, cylinder(), 3, tmp_path / "3.png")


def test_a_thumbnail_is_small_and_transparent_around_the_grasp(traces, tmp_path):
    thumbnail_stored(traces, cylinder(), 1, tmp_path / "small.webp")
    assert (tmp_path / "small.webp").stat().st_size < 15_000
    image = np.asarray(Image.open(tmp_path / "small.webp").convert("RGBA"))
    assert image.shape == (144, 192, 4)
    assert image[0, 0, 3] == 0
    assert 0.15 < (image[..., 3] > 200).mean() < 0.9


def test_the_moving_picture_moves_and_ends_in_the_grasp(traces, tmp_path):
    animate_stored(traces, cylinder(), 1, tmp_path / "moving.webp")
    with Image.open(tmp_path / "moving.webp") as moving:
        assert 8 <= moving.n_frames <= 16
        frames = []
        for number in range(moving.n_frames):
            moving.seek(number)
            frames.append(np.asarray(moving.convert("RGBA")).astype(int))
    assert np.abs(frames[0] - frames[-1]).mean() > 2
    assert (tmp_path / "moving.webp").stat().st_size < 300_000
