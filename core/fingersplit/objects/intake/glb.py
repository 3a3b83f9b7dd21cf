"""GLB (binary glTF 2.0): lengths and counts against the file's bytes, and the size that the scene unfolds to."""

import io
import json
import struct
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake.polygons import Polygons
from fingersplit.objects.intake.refusals import MAX_FACES, check_count, malformed, truncated

__all__ = ["parse_glb"]

_MAX_PIECES, _MAX_LEVELS = 10_000, 100  # nodes may repeat a mesh, so a small file could ask for any number
_MAX_COPIES = 10  # of the binary chunk, made by the parser for views and accessors, which may overlap
_REPACKED = {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization"}
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "MSFT_texture_", "EXT_lights_", "KHR_xmp")
"""Beginnings of the names of extensions that say how things look, not where they are."""
_COMPONENT_BYTES = {"VEC3": {5126: 4}, "SCALAR": {5121: 1, 5123: 2, 5125: 4}}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # primitive modes; the others are points and lines
_LOCATING = ("bufferView", "byteOffset", "componentType", "count", "type")
_PLACING = ("children", "mesh", "matrix", "translation", "rotation", "scale")

_Entry = dict[str, Any]


def parse_glb(data: bytes) -> tuple[NDArray[np.float64], Polygons]:
    """Vertices (n, 3) and triangles of all meshes of the scene in the file, placed by their nodes."""
    scene = trimesh.load_scene(io.BytesIO(_checked(data)), file_type="glb", process=False, skip_materials=True)
    meshes = [each for each in scene.dump() if isinstance(each, trimesh.Trimesh)]
    vertices, faces = trimesh.util.append_faces([each.vertices for each in meshes], [each.faces for each in meshes])
    return np.asarray(vertices, np.float64).reshape(-1, 3), Polygons.of_triangles(np.asarray(faces).reshape(-1, 3))


def _checked(data: bytes) -> bytes:
    """A GLB file written anew with nodes, triangles and their positions only, so that no other file is read."""
    text, binary = _read_chunks(data)
    text = json.dumps(_kept(text, len(binary))).encode()
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _read_chunks(data: bytes) -> tuple[bytes, bytes]:
    """The JSON text and the binary chunk, with every length compared with the file's."""
    if data[:4] != b"glTF" or len(data) < 20:
        raise ObjectFileError("not_glb", "The file does not start with the 'glTF' header of a GLB file.")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise ObjectFileError("not_glb", f"The GLB file has version {version}; version 2 is needed.")
    if length > len(data):
        raise truncated(f"{length:,} bytes", f"{len(data):,}")
    chunks, offset = dict[bytes, bytes](), 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, offset)
        if offset + 8 + size > length:
            raise truncated(f"a chunk of {size:,} bytes", f"{length - offset - 8:,}")
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
        offset += 8 + size
    return chunks.get(b"JSON", b""), chunks.get(b"BIN\0", b"")


def _kept(text: bytes, n_bytes: int) -> _Entry:
    """The parts of a glTF text that place triangles."""
    try:
        return _kept_document(json.loads(text), n_bytes)
    except (json.JSONDecodeError, UnicodeDecodeError):
        raise malformed("The GLB file's JSON chunk is no valid JSON.") from None
    except RecursionError:
        raise malformed("The GLB file's JSON chunk is nested too deeply.") from None
    except KeyError as error:
        raise malformed(f"An entry of the GLB document lacks {error.args[0]!r}.") from None
    except (AttributeError, TypeError, ValueError):
        raise malformed("The GLB document has a list, number or entry where glTF 2.0 wants another kind.") from None


def _kept_document(document: _Entry, n_bytes: int) -> _Entry:
    """The parts of a glTF document that place triangles; entries that those do not use are left empty."""
    required = set(document.get("extensionsRequired", []))
    packed = _REPACKED & required
    if packed:
        raise ObjectFileError(
            "compressed", f"The GLB geometry is packed with {min(packed)}; export it without compression."
        )
    unknown = sorted(name for name in required - _REPACKED if not name.startswith(_HARMLESS))
    if unknown:
        what = f"The GLB file requires the extension {unknown[0]}, which is not read; export it without."
        raise ObjectFileError("unknown_extension", what)
    if not document.get("meshes"):
        raise ObjectFileError("no_faces", "The GLB file has no mesh in it; a surface is needed.")
    meshes = [{"primitives": list(_kept_primitives(mesh))} for mesh in document["meshes"]]
    nodes = [{key: node[key] for key in _PLACING if key in node} for node in document.get("nodes", [])]
    roots = _roots(document, nodes)
    accessors: list[_Entry] = [{"type": "SCALAR", "componentType": 5121, "count": 0}] * len(
        document.get("accessors", [])
    )
    views: list[_Entry] = [{"buffer": 0, "byteLength": 0}] * len(document.get("bufferViews", []))
    n_copied = 0
    for index, kind in dict.fromkeys(use for mesh in meshes for each in mesh["primitives"] for use in _uses(each)):
        accessors[index], view, n_value_bytes = _checked_accessor(document, index, kind, n_bytes)
        views[accessors[index]["bufferView"]] = view
        n_copied += n_value_bytes
    n_copied += sum(view["byteLength"] for view in views)
    if n_copied > _MAX_COPIES * n_bytes:
        raise malformed(f"The GLB accessors overlap: they take {n_copied:,} bytes out of {n_bytes:,}.")
    for shown in range(len(meshes)), list(_placed_meshes(nodes, roots, len(meshes))):
        # Each mesh is read once, and then copied to each node.
        _check_sizes((each for mesh in shown for each in meshes[mesh]["primitives"]), accessors)
    for node in nodes:
        if "mesh" in node and not meshes[node["mesh"]]["primitives"]:
            del node["mesh"]  # trimesh loses the children of a node whose mesh is only points or lines
    return {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": n_bytes}],
    }


def _roots(document: _Entry, nodes: list[_Entry]) -> list[int]:
    """Nodes of the scene that is shown first; in a file without scenes, all that hang below no other."""
    if document.get("scenes"):
        roots: list[int] = _entry(document, "scenes", document.get("scene", 0)).get("nodes", [])
        return roots
    children = {child for node in nodes for child in node.get("children", [])}
    return [index for index in range(len(nodes)) if index not in children]


def _kept_primitives(mesh: _Entry) -> Iterator[_Entry]:
    for primitive in mesh["primitives"]:
        mode = primitive.get("mode", _TRIANGLES)
        if mode == _FAN:
            raise malformed("The GLB file has triangle fans, which are not supported; triangles and strips are.")
        if mode in (_TRIANGLES, _STRIP):
            indices = {"indices": primitive["indices"]} if "indices" in primitive else {}
            yield {"mode": mode, "attributes": {"POSITION": primitive["attributes"]["POSITION"]}, **indices}


def _uses(primitive: _Entry) -> Iterator[tuple[int, str]]:
    """Each accessor of a primitive and what kind of values it should have."""
    yield primitive["attributes"]["POSITION"], "VEC3"
    if "indices" in primitive:
        yield primitive["indices"], "SCALAR"


def _checked_accessor(document: _Entry, index: int, kind: str, n_bytes: int) -> tuple[_Entry, _Entry, int]:
    """An accessor, whose values all lie in the binary chunk's ``n_bytes``, its view, and the bytes of its values."""
    accessor = _entry(document, "accessors", index)
    if accessor["type"] != kind or accessor["componentType"] not in _COMPONENT_BYTES[kind] or "sparse" in accessor:
        raise malformed(f"GLB accessor {index} is no plain list of {kind} values.")
    view = _entry(document, "bufferViews", accessor["bufferView"])
    if view["buffer"] != 0 or "uri" in _entry(document, "buffers", 0):
        raise ObjectFileError("external_data", "The GLB geometry lies in another file; export it as a single GLB.")
    width = _COMPONENT_BYTES[kind][accessor["componentType"]] * (3 if kind == "VEC3" else 1)
    count, first, start = accessor["count"], accessor.get("byteOffset", 0), view.get("byteOffset", 0)
    stride = view.get("byteStride", width)
    if min(count, first, start, stride - width) < 0:
        raise malformed(f"GLB accessor {index} has a negative count, offset or stride.")
    present = min(view["byteLength"], n_bytes - start)
    if count and first + (count - 1) * stride + width > present:
        raise truncated(f"{count:,} values in accessor {index}", f"{max(present, 0):,} bytes for them")
    return {key: accessor[key] for key in _LOCATING if key in accessor}, view, count * width


def _check_sizes(primitives: Iterable[_Entry], accessors: list[_Entry]) -> None:
    n_pieces = n_points = n_faces = 0
    for primitive in primitives:
        points = accessors[primitive["attributes"]["POSITION"]]["count"]
        corners = accessors[primitive["indices"]]["count"] if "indices" in primitive else points
        n_pieces, n_points = n_pieces + 1, n_points + points
        n_faces += corners // 3 if primitive["mode"] == _TRIANGLES else corners
        check_count(n_faces, MAX_FACES)
        check_count(n_points, MAX_FACES, "vertices")
        if n_pieces > _MAX_PIECES:
            raise malformed(f"The GLB scene consists of more than {_MAX_PIECES:,} pieces.")


def _placed_meshes(nodes: list[_Entry], roots: list[int], n_meshes: int) -> Iterator[int]:
    """Index of each mesh that a node of the scene shows, once for each such node."""
    waiting, seen = [(root, 1) for root in roots], set[int]()
    while waiting:
        index, level = waiting.pop()
        if index in seen:
            raise malformed(f"Node {index} of the GLB scene hangs in its tree twice.")
        if level > _MAX_LEVELS:
            raise malformed(f"The GLB scene has nodes more than {_MAX_LEVELS} levels deep.")
        if not 0 <= index < len(nodes):
            raise malformed(f"The GLB document names nodes[{index}], but has {len(nodes)} of them.")
        seen.add(index)
        if len(seen) > _MAX_PIECES:
            raise malformed(f"The GLB scene has more than {_MAX_PIECES:,} nodes.")
        waiting += [(child, level + 1) for child in nodes[index].get("children", [])]
        if "mesh" in nodes[index]:
            if not 0 <= nodes[index]["mesh"] < n_meshes:
                raise malformed(f"The GLB document names meshes[{nodes[index]['mesh']}], but has {n_meshes} of them.")
            yield nodes[index]["mesh"]


def _entry(document: _Entry, section: str, index: int) -> _Entry:
    """Entry of a top-level list."""
    entries: list[_Entry] = document[section]
    if not 0 <= index < len(entries):
        raise malformed(f"The GLB document names {section}[{index}], but has {len(entries)} of them.")
    return entries[index]
