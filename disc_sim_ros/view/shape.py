"""The shape of the disc in a page: a domed plate with a rim, in coloured sectors."""

import json
import math
import struct
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from disc_sim_ros.arrays import FloatArray

SECTORS = 12
_UNSIGNED, _FLOAT = 5125, 5126  # numbers of glTF for integers and floats of 32 bits
_PER_SECTOR = 6  # flat faces around the rim
# From the middle of the top over the rim to the middle of the underside: radius and height, in
# diameters. The plane of the disc, z = 0, goes through the centre of mass.
_PROFILE = (
    (0.0, 0.045), (0.15, 0.044), (0.3, 0.038), (0.4, 0.028), (0.45, 0.014), (0.485, -0.012),
    (0.5, -0.038), (0.497, -0.062), (0.48, -0.07), (0.462, -0.066), (0.455, -0.04),
    (0.448, -0.005), (0.4, 0.014), (0.3, 0.027), (0.15, 0.034), (0.0, 0.035),
)  # fmt: skip
# Sectors of a colour are meshes of their own, so that the page can give each disc its colour.
PARTS = {'plain': (0.96, 0.96, 0.94), 'coloured': (0.0, 0.447, 0.698), 'mark': (0.02, 0.02, 0.03)}


def part_of(sector: int) -> str:
    """Return the part that a sector belongs to: one mark shows the turns, the others alternate."""
    return 'mark' if sector == 0 else ('plain', 'coloured')[sector % 2]


def glb() -> bytes:
    """Return the parts of a disc of diameter 1 in `disc_body` (x forward, y left, z up).

    As a file of the kind GLB: binary glTF 2.0, with a mesh and a material for each part, and the
    camera that the page of trimesh asks for.
    """
    data = b''
    views: list[dict[str, int]] = []
    accessors: list[dict[str, Any]] = []

    def added(array: 'NDArray[Any]', component: int) -> int:
        """Append an array of numbers or of vectors, and return its place."""
        nonlocal data
        accessor = {
            'bufferView': len(views), 'componentType': component, 'count': len(array),
            'type': 'SCALAR' if array.ndim == 1 else 'VEC3',
        }  # fmt: skip
        accessors.append(
            accessor | {'min': _list_of(array.min(axis=0)), 'max': _list_of(array.max(axis=0))}
        )
        content = array.tobytes()
        views.append({'buffer': 0, 'byteOffset': len(data), 'byteLength': len(content)})
        data += content
        return len(accessors) - 1

    meshes, materials = [], []
    for k, (name, colour) in enumerate(PARTS.items()):
        vertices, normals, faces = _turned([i for i in range(SECTORS) if part_of(i) == name])
        indices = added(faces.astype('<u4').ravel(), _UNSIGNED)
        attributes = {
            'POSITION': added(vertices.astype('<f4'), _FLOAT),
            'NORMAL': added(normals.astype('<f4'), _FLOAT),
        }
        part = {'attributes': attributes, 'indices': indices, 'material': k}
        meshes.append({'name': name, 'primitives': [part]})
        surface = {
            'baseColorFactor': [*colour, 1.0],
            'metallicFactor': 0.0,
            'roughnessFactor': 0.6,
        }
        materials.append({'name': name, 'pbrMetallicRoughness': surface, 'doubleSided': True})
    lens = {'aspectRatio': 4.0 / 3.0, 'yfov': math.radians(45.0), 'znear': 0.01}
    nodes = [{'name': name, 'mesh': k} for k, name in enumerate(PARTS)]
    document = {
        'asset': {'version': '2.0'},
        'scene': 0,
        'scenes': [{'nodes': list(range(len(nodes) + 1))}],
        'nodes': [*nodes, {'name': 'camera', 'camera': 0, 'translation': [0.0, 0.0, 1.25]}],
        'cameras': [{'name': 'camera', 'type': 'perspective', 'perspective': lens}],
        'meshes': meshes,
        'materials': materials,
        'accessors': accessors,
        'bufferViews': views,
        'buffers': [{'byteLength': len(data)}],
    }
    text = json.dumps(document, separators=(',', ':')).encode()
    chunks = _chunk(b'JSON', text + b' ' * (-len(text) % 4)) + _chunk(b'BIN\0', data)
    return struct.pack('<4sII', b'glTF', 2, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack('<I4s', len(content), kind) + content


def _list_of(numbers: 'NDArray[Any]') -> list[float]:
    """Return one number or three as glTF has them."""
    listed: list[float] = np.atleast_1d(numbers).tolist()
    return listed


def _turned(sectors: list[int]) -> 'tuple[FloatArray, FloatArray, NDArray[np.int_]]':
    """Return the profile turned about z over some sectors.

    Args:
        sectors: Numbers of the sectors.

    Returns:
        Corners, shape (n, 3); their smooth normals of unit length, shape (n, 3); and the numbers
        of the corners of each triangle, shape (m, 3).
    """
    radius, height = np.array(_PROFILE).T
    # The outward normal of each edge of the profile; corners take the mean of their edges.
    edges = np.diff(np.array(_PROFILE), axis=0)
    sides = edges @ np.array([[0.0, 1.0], [-1.0, 0.0]])  # a quarter turn to the left
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    corners = np.vstack([[0.0, 1.0], sides[:-1] + sides[1:], [0.0, -1.0]])
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    vertices: list[FloatArray] = []
    normals: list[FloatArray] = []
    faces: list[NDArray[np.int_]] = []
    n = len(radius)
    for sector in sectors:
        angles = 2.0 * np.pi / SECTORS * (sector + np.linspace(0.0, 1.0, _PER_SECTOR + 1))
        first = n * len(vertices)
        for i, angle in enumerate(angles):
            c, s = np.cos(angle), np.sin(angle)
            vertices.append(np.column_stack([radius * c, radius * s, height]))
            out, up = corners.T
            normals.append(np.column_stack([out * c, out * s, up]))
            if i == _PER_SECTOR:
                break
            a = first + i * n + np.arange(n - 1)
            faces += [
                np.column_stack([a, a + 1, a + n]),
                np.column_stack([a + 1, a + n + 1, a + n]),
            ]
    return np.vstack(vertices), np.vstack(normals), np.vstack(faces)
