"""Pictures of plans: real files, from a process without display or OpenGL."""

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
from fingersplit.recording.pictures import draw_animation, draw_picture, draw_thumbnail
from fingersplit.recording.replay import replay
from fingersplit.result import write_result

DRAW = """
import sys
from pathlib import Path
from fingersplit.hands import load_hand
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.parametric import cylinder
from fingersplit.recording.pictures import draw_picture
from fingersplit.recording.replay import replay
from fingersplit.result import read_result
model, hand = prepare_object(cylinder(), "cylinder"), load_hand("barrett")
draw_picture(Path(sys.argv[2]), replay(read_result(Path(sys.argv[1])), 1, model, hand), model, hand)
maps = Path("/proc/self/maps")
loaded = maps.read_text() if maps.exists() else " ".join(sys.modules)
found = [name for name in ("libGL", "libEGL", "libOSMesa", "OpenGL") if name in loaded]
sys.exit(f"loaded {found}" if found else 0)
"""


@pytest.fixture(scope="module")
def model():
    return prepare_object(cylinder(), "cylinder")


@pytest.fixture(scope="module")
def planned(model, barrett):
    return plan(model, barrett, starts=8, top_k=2, seed=3)


def test_a_picture_comes_out_without_display_or_opengl(planned, tmp_path):
    stored, png = tmp_path / "plan.json", tmp_path / "grasp.png"
    write_result(planned, stored)
    hidden = {"DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL", "PYOPENGL_PLATFORM"}
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    subprocess.run([sys.executable, "-c", DRAW, str(stored), str(png)], env=environment, check=True, timeout=120)
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


def test_ranks_differ(planned, model, barrett, tmp_path):
    pictures = []
    for rank in (1, 2):
        draw_picture(tmp_path / f"{rank}.png", replay(planned, rank, model, barrett), model, barrett)
        pictures.append(imread(tmp_path / f"{rank}.png"))
    assert not np.array_equal(*pictures)


def test_a_thumbnail_is_small_and_transparent_around_the_grasp(planned, model, barrett, tmp_path):
    draw_thumbnail(tmp_path / "small.webp", planned.grasps[0].for_hand(barrett), model, barrett)
    assert (tmp_path / "small.webp").stat().st_size < 15_000
    image = np.asarray(Image.open(tmp_path / "small.webp").convert("RGBA"))
    assert image.shape == (144, 192, 4)
    assert image[0, 0, 3] == 0
    assert 0.15 < (image[..., 3] > 200).mean() < 0.9


def test_the_moving_picture_moves_and_ends_in_the_grasp(planned, model, barrett, tmp_path):
    draw_animation(tmp_path / "moving.webp", replay(planned, 1, model, barrett), model, barrett)
    with Image.open(tmp_path / "moving.webp") as moving:
        assert 8 <= moving.n_frames <= 16
        frames = []
        for number in range(moving.n_frames):
            moving.seek(number)
            frames.append(np.asarray(moving.convert("RGBA")).astype(int))
    assert np.abs(frames[0] - frames[-1]).mean() > 2
    assert (tmp_path / "moving.webp").stat().st_size < 300_000
