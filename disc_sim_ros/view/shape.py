"""The shape of the disc in a page: a domed plate with a rim, in coloured sectors."""

from typing import TYPE_CHECKING

import numpy as np
import trimesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from disc_sim_ros.arrays import FloatArray

SECTORS = 12
_FIELD_OF_VIEW = (60.0, 45.0)  # degrees, as trimesh has it; the page's own camera replaces it
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


def scene() -> trimesh.Scene:
    """Return the parts of a disc of diameter 1 in `disc_body`: x forward, y left, z up."""
    meshes: dict[str, trimesh.parent.Geometry] = {}
    for name, colour in PARTS.items():
        sectors = [sector for sector in range(SECTORS) if part_of(sector) == name]
        mesh = _turned(sectors)
        mesh.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name=name,
                baseColorFactor=[*colour, 1.0],
                metallicFactor=0.0,
                roughnessFactor=0.6,
                doubleSided=True,
            )
        )
        meshes[name] = mesh
    # Without a name trimesh draws one, and no two pages would have the same bytes.
    camera = trimesh.scene.Camera(name='camera', fov=_FIELD_OF_VIEW)
    made = trimesh.Scene(meshes, camera=camera)
    made.set_camera(fov=camera.fov)
    return made


def _turned(sectors: list[int]) -> trimesh.Trimesh:
    """Return the profile turned about z over some sectors, with smooth normals."""
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
    return trimesh.Trimesh(
        np.vstack(vertices), np.vstack(faces), vertex_normals=np.vstack(normals), process=False
    )
