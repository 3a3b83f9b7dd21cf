"""Numbers in text formats mean what the format says, not all that Python reads as a number."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.errors import FormatError, ObjectFileError, SceneError
from fingersplit.formats.fields import numbers
from fingersplit.numerals import read_floats, read_integers
from fingersplit.objects.intake import read_bytes
from fingersplit.objects.source import ObjectSource
from fingersplit.scene.approach import ApproachCone

POINTS = "0 0 0", "{} 0 0", "0 0.03 0", "0 0 0.03"
FACES = (0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)


def _obj(word: str, corner: str = "1") -> str:
    faces = [[corner if (k, c) == (0, 0) else str(c + 1) for c in face] for k, face in enumerate(FACES)]
    return "".join(f"v {p.format(word)}\n" for p in POINTS) + "".join(f"f {' '.join(face)}\n" for face in faces)


def _off(word: str, corner: str = "0") -> str:
    faces = [[corner if (k, c) == (0, 0) else str(c) for c in face] for k, face in enumerate(FACES)]
    points = "".join(f"{p.format(word)}\n" for p in POINTS)
    return "OFF\n4 4 0\n" + points + "".join(f"3 {' '.join(face)}\n" for face in faces)


def _ply(word: str, corner: str = "0") -> str:
    header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    return header + _off(word, corner).removeprefix("OFF\n4 4 0\n")


def _stl(word: str) -> str:
    text = "solid one\n"
    for face in FACES:
        corners = "".join(f"vertex {POINTS[c].format(word)}\n" for c in face)
        text += f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n"
    return text + "endsolid one\n"


def _pcd(word: str) -> str:
    fields = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA ascii\n"
    return fields + "".join(f"{p.format(word)}\n" for p in POINTS)


WRITERS = {"obj": _obj, "off": _off, "ply": _ply, "stl": _stl, "pcd": _pcd}
WRONG = ("4_0.0", "0.0_3", "1e-0_2", "٣", "0x1p-5", "3d-2", "½", "0,03")
MESHES = ("obj", "off", "ply", "stl")


def _read(text: str, suffix: str) -> object:
    return read_bytes(text.encode(), suffix, ObjectSource())


@pytest.mark.parametrize("word", WRONG)
@pytest.mark.parametrize("suffix", WRITERS)
def test_words_that_are_no_numbers_of_the_format_are_refused(suffix, word):
    with pytest.raises(ObjectFileError) as caught:
        _read(WRITERS[suffix](word), suffix)
    assert word.lower() in str(caught.value).lower()


@pytest.mark.parametrize("word", ["nan", "inf", "-Infinity", "NaN", "1e999"])
@pytest.mark.parametrize("suffix", MESHES)
def test_vertices_that_are_not_finite_are_refused(suffix, word):
    with pytest.raises(ObjectFileError, match="finite"):
        _read(WRITERS[suffix](word), suffix)


@pytest.mark.parametrize("corner", ["1_0", "0_1", "٣", "1.5", "0x1", "9" * 5000])
@pytest.mark.parametrize("suffix", ["obj", "off", "ply"])
def test_corners_that_are_no_whole_numbers_are_refused(suffix, corner):
    with pytest.raises(ObjectFileError) as caught:
        _read(WRITERS[suffix]("0.03", corner), suffix)
    assert "line" in str(caught.value).lower()


@pytest.mark.parametrize("suffix", MESHES)
@given(value=st.floats(0.01, 0.2), form=st.sampled_from(["{:f}", "{:.17e}", "+{:g}", "{:E}"]))
def test_decimal_numbers_are_read(suffix, value, form):
    word = form.format(value)

    mesh, _ = read_bytes(WRITERS[suffix](word).encode(), suffix, ObjectSource())

    assert mesh.extents[0] == pytest.approx(float(word), rel=1e-6)


def test_a_fraction_is_no_vertex_of_an_obj():
    with pytest.raises(ObjectFileError, match="1/30"):
        _read(_obj("1/30"), "obj")


def test_textures_and_normals_behind_the_corners_of_an_obj_are_left_out():
    mesh, _ = _read(_obj("0.03", "1/7/2").replace("f 1 2 4", "f 1//3 2 4/5"), "obj")
    assert mesh.volume == pytest.approx(0.03**3 / 6)


@pytest.mark.parametrize("length", ["3.5", "nan", "-3", "3_0"])
def test_lists_have_whole_lengths(length):
    with pytest.raises(ObjectFileError):
        _read(_ply("0.03").replace("\n3 ", f"\n{length} ", 1), "ply")


@given(st.text(max_size=8))
def test_what_is_read_has_no_underscore_and_no_digit_of_another_script(text):
    word = text.encode(errors="replace")
    for read in (read_floats, read_integers):
        try:
            read([word])
        except ValueError:
            continue
        assert word.isascii()
        assert b"_" not in word


@pytest.mark.parametrize("value", ["4_0", ["1", "2", "3"], [1.0, "٣", 2.0], b"3"])
def test_texts_are_no_numbers_of_grasp_files(value):
    with pytest.raises(FormatError, match="must be numbers"):
        numbers(value, "position", (3,) if isinstance(value, list) else ())


@pytest.mark.parametrize("angle", ["3_5", "٣٥", "nan", "inf", "abc"])
def test_angles_of_approach_are_plain_numbers(angle):
    with pytest.raises(SceneError, match="angle"):
        ApproachCone.parse(f"down:{angle}")
