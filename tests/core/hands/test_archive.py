"""Hands in archives: honest ones load, hostile ones are refused with a reason and leave nothing behind."""

import io
import stat
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest

from fingersplit.errors import HandError
from fingersplit.hands import load_hand
from fingersplit.hands.archive import unpack
from own_hand import description, hand_mjcf, to_toml

MODEL, TEXT = hand_mjcf(), to_toml(description())


def zipped(files: dict[str, str | bytes], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def with_member(info: zipfile.ZipInfo, content: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("hand.xml", MODEL)
        archive.writestr(info, content)
    return buffer.getvalue()


def symlink(name: str, target: str) -> bytes:
    info = zipfile.ZipInfo(name)
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    return with_member(info, target.encode())


def model_with(text: str) -> bytes:
    return zipped({"hand.xml": MODEL.replace("<worldbody>", text + "<worldbody>"), "hand.toml": TEXT})


def lying_about_its_size() -> bytes:
    data = bytearray(zipped({"hand.xml": b"<mujoco/>" * 4_000_000}))
    central = data.rfind(b"PK\x01\x02")
    data[central + 24 : central + 28] = (10).to_bytes(4, "little")
    return bytes(data)


@pytest.mark.parametrize("folder", ["", "my_hand/"])
def test_hand_in_a_zip_is_the_hand_in_the_folder(tmp_path, folder):
    path = tmp_path / "own.zip"
    path.write_bytes(zipped({f"{folder}hand.xml": MODEL, f"{folder}hand.toml": TEXT}))
    hand = load_hand(path)
    assert hand.name == "own"
    (tmp_path / "plain").mkdir()
    (tmp_path / "plain" / "hand.xml").write_text(MODEL)
    (tmp_path / "plain" / "hand.toml").write_text(TEXT)
    plain = load_hand(tmp_path / "plain")
    assert plain.sha256 == hand.sha256
    np.testing.assert_array_equal(plain.arrays.positions, hand.arrays.positions)


HOSTILE = {
    "not a zip": (b"PK\x03\x04 no", "no zip file"),
    "parent": (zipped({"../hand.xml": MODEL}), "no path inside it"),
    "absolute": (zipped({"/tmp/hand.xml": MODEL}), "no path inside it"),
    "drive": (zipped({"C:/hand.xml": MODEL}), "no path inside it"),
    "backslash": (zipped({"a\\..\\hand.xml": MODEL}), "no path inside it|no plain file name"),
    "command": (zipped({"$(touch x).xml": MODEL}), "no plain file name"),
    "new line": (zipped({"a\nb.xml": MODEL}), "no plain file name"),
    "program": (zipped({"hand.py": "print()"}), "leave it out"),
    "twice": (zipped({"Hand.xml": MODEL, "hand.xml": MODEL}), "same name"),
    "many": (zipped({f"{k}.txt": "" for k in range(600)}), "at most 500"),
    "symlink": (symlink("palm.stl", "/etc/passwd"), "a link or a device"),
    "bomb": (zipped({"hand.xml": b"\0" * (70 << 20)}), "unpacks to"),
    "lying bomb": (lying_about_its_size(), "unpacks to more|cannot be|is not XML"),
    "entities": (
        zipped({"hand.xml": '<!DOCTYPE m [<!ENTITY a "b"><!ENTITY c "&a;&a;">]><mujoco>&c;</mujoco>'}),
        "declares a document type or entities",
    ),
    "external entity": (
        zipped({"hand.xml": '<!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]><mujoco>&a;</mujoco>'}),
        "declares a document type or entities",
    ),
    "deep": (zipped({"hand.xml": "<a>" * 500 + "</a>" * 500}), "nests deeper"),
    "long": (zipped({"hand.xml": "<a>" + "<b/>" * 30_000 + "</a>"}, zipfile.ZIP_STORED), "more than 20000 elements"),
    "include outside": (model_with('<include file="../../secret.xml"/>'), "leads out of the archive"),
    "mesh outside": (model_with('<asset><mesh file="/etc/passwd"/></asset>'), "no path inside the archive"),
    "mesh by address": (model_with('<asset><mesh file="http://x/y.stl"/></asset>'), "no path inside the archive"),
    "mesh not there": (model_with('<asset><mesh file="palm.stl"/></asset>'), "the archive does not hold"),
    "folder outside": (model_with('<compiler meshdir="../.."/>'), "leads out of the archive"),
    "plugin": (model_with('<extension><plugin plugin="x"/></extension>'), "an uploaded hand may not"),
    "not XML": (zipped({"hand.xml": "<mujoco><"}), "is not XML"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_archive_is_refused_with_a_reason(tmp_path, case):
    data, said = HOSTILE[case]
    with pytest.raises(HandError, match=said):
        unpack(data, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Bytes changed, cut out, doubled or cut off, sometimes inside of a file that is then packed again."""
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 12))):
        place = int(rng.integers(len(changed)))
        kind = rng.integers(4)
        if kind == 0:
            changed[place] = int(rng.integers(256))
        elif kind == 1:
            del changed[place : place + int(rng.integers(1, 40))]
        elif kind == 2:
            changed[place:place] = changed[place : place + int(rng.integers(1, 40))]
        elif rng.uniform() < 0.2:
            del changed[place:]
        if not changed:
            return b"\0"
    return bytes(changed)


def try_archive(data: bytes, folder: Path, seed: int) -> str:
    """What becomes of a mutated archive: refused, or loaded; any other error is the test's."""
    rng = np.random.default_rng(seed)
    if seed % 2:
        data = mutated(data, rng)
    else:
        files = {name: zipfile.ZipFile(io.BytesIO(data)).read(name) for name in ("hand.xml", "hand.toml")}
        name = ("hand.xml", "hand.toml")[seed // 2 % 2]
        data = zipped(files | {name: mutated(files[name], rng)})
    path = folder / f"{seed}.zip"
    path.write_bytes(data)
    try:
        load_hand(path)
    except HandError:
        return "refused"
    return "loaded"


def run_mutations(folder: Path, seeds: range) -> None:
    outside = folder / "outside"
    outside.mkdir()
    data = zipped({"hand.xml": MODEL, "hand.toml": TEXT})
    assert zlib.crc32(data)
    ends = [try_archive(data, folder, seed) for seed in seeds]
    assert ends.count("refused") > len(ends) / 4
    assert list(outside.iterdir()) == []


def test_mutated_archives_are_refused_or_load(tmp_path):
    run_mutations(tmp_path, range(60))


@pytest.mark.campaign
def test_a_thousand_mutated_archives_are_refused_or_load(tmp_path):
    run_mutations(tmp_path, range(1000))
