import io
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fingersplit.objects.intake import read_file
from fingersplit.objects.mesh import Mesh
from fingersplit_client import InvalidRequestError
from fingersplit_client.mesh_files import read_mesh

VERTICES = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]


@pytest.mark.parametrize(
    "source",
    [
        (VERTICES, FACES),
        (np.array(VERTICES, dtype=np.float32), np.array(FACES, dtype=np.uint16)),
        SimpleNamespace(vertices=np.array(VERTICES), faces=np.array(FACES)),
    ],
)
def test_arrays_are_a_file_that_the_service_reads(source: object, tmp_path: Path) -> None:
    file = read_mesh(source, None)  # type: ignore[arg-type]
    path = tmp_path / file.filename
    path.write_bytes(file.content)
    mesh, report = read_file(path)
    assert isinstance(mesh, Mesh)
    assert (report.vertices, report.faces, report.watertight) == (4, 4, True)
    np.testing.assert_allclose(sorted(mesh.vertices.tolist()), sorted(VERTICES), atol=1e-7)
    assert report.volume == pytest.approx(0.1**3 / 6, rel=1e-6)


def test_a_path_an_open_file_and_bytes_are_the_same_file(tmp_path: Path) -> None:
    path = tmp_path / "cup.off"
    path.write_bytes(b"OFF")
    with path.open("rb") as opened:
        files = [read_mesh(source, None) for source in (path, str(path), opened)]
    files.append(read_mesh(io.BytesIO(b"OFF"), "off"))
    files.append(read_mesh(b"OFF", ".off"))
    assert [file.filename for file in files] == ["cup.off"] * 3 + ["object.off"] * 2
    assert len({file.sha256 for file in files}) == 1


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (b"OFF", "file_type"),
        (io.BytesIO(b"OFF"), "file_type"),
        (io.StringIO("OFF"), "mode 'rb'"),
        (42, "int is no mesh"),
        ((VERTICES, [(0, 1, 4)]), r"\(0, 1, 4\) names vertices"),
        ((VERTICES, [(0, 1, -1)]), "names vertices"),
        (([(0.0, 1.0)], FACES), "vertices must be rows of three"),
        ((VERTICES, [(0, 1, 2, 3)]), "faces must be rows of three"),
        ((VERTICES, []), "there are none"),
    ],
)
def test_what_is_no_mesh_is_refused_with_the_reason(source: object, message: str) -> None:
    with pytest.raises(InvalidRequestError, match=message):
        read_mesh(source, None)  # type: ignore[arg-type]
