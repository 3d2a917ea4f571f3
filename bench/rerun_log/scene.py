"""A rig as rerun geometry: what the compiled model holds, hung under its bodies, and the bodies moved along a record.

Geometry hangs under the entity of its body and is sent once; only body poses are sent over time. Skins (coil springs
between two bodies) are cut into slices, each moved by the affine map closest to MuJoCo's skinning: a few matrices a
frame instead of thousands of vertices.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

from bench.errors import UnknownNameError
from bench.rerun_log.kinematics import BodyPoses


@dataclass(frozen=True)
class SceneSettings:
    """Numbers of `bench.rerun_log.scene`."""

    visible_groups: int = 3
    """Geometry groups shown: those below it, as in MuJoCo's own viewer."""
    skin_slices: int = 12
    """Slices of a skin whose ends turn against each other: an arc of 1/12 of the angle becomes a chord."""
    viewer_field_of_view: float = np.deg2rad(55.0)
    """Vertical field of view of rerun's 3-D views; MuJoCo's cameras are moved along their axis to match it."""
    margin: float = 1.15
    """Distance of the eye over the one at which the picture's height agrees: the nearer view sees near parts larger."""


SETTINGS = SceneSettings()


class Eye(NamedTuple):
    """Where a 3-D view is looked at from."""

    position: NDArray[np.float64]  # (3,) [m]
    target: NDArray[np.float64]  # (3,) [m]


def _names(model: mujoco.MjModel, geoms: Iterable[int]) -> list[str]:
    return [model.geom(geom).name or f"geom_{geom}" for geom in geoms]


def _colour(model: mujoco.MjModel, rgba: NDArray, material: int) -> NDArray[np.uint8]:
    """The colour MuJoCo draws: the material's, unless the geometry states its own."""
    stated = not np.allclose(rgba, (0.5, 0.5, 0.5, 1.0))
    shown = rgba if stated or material < 0 else model.mat_rgba[material]
    return np.round(255.0 * np.clip(shown, 0.0, 1.0)).astype(np.uint8)


def _geom_colours(model: mujoco.MjModel, geoms: Sequence[int]) -> NDArray[np.uint8]:
    return np.array([_colour(model, model.geom_rgba[g], int(model.geom_matid[g])) for g in geoms])


def _rotation(quaternion: NDArray) -> NDArray[np.float64]:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _boxes(model: mujoco.MjModel, geoms: list[int], common: dict) -> rr.Boxes3D:
    return rr.Boxes3D(
        half_sizes=model.geom_size[geoms],
        centers=model.geom_pos[geoms],
        quaternions=np.roll(model.geom_quat[geoms], -1, axis=1),
        **common,
    )


def _ellipsoids(model: mujoco.MjModel, geoms: list[int], common: dict) -> rr.Ellipsoids3D:
    size = model.geom_size[geoms].copy()
    spheres = model.geom_type[geoms] == int(mujoco.mjtGeom.mjGEOM_SPHERE)
    size[spheres] = size[spheres, :1]
    return rr.Ellipsoids3D(
        half_sizes=size,
        centers=model.geom_pos[geoms],
        quaternions=np.roll(model.geom_quat[geoms], -1, axis=1),
        **common,
    )


def _cylinders(model: mujoco.MjModel, geoms: list[int], common: dict) -> rr.Cylinders3D:
    return rr.Cylinders3D(
        radii=model.geom_size[geoms, 0],
        lengths=2.0 * model.geom_size[geoms, 1],
        centers=model.geom_pos[geoms],
        quaternions=np.roll(model.geom_quat[geoms], -1, axis=1),
        **common,
    )


def _capsules(model: mujoco.MjModel, geoms: list[int], common: dict) -> rr.Capsules3D:
    half = model.geom_size[geoms, 1]
    # rerun's capsules begin at their lower cap centre, MuJoCo's lie symmetric about theirs.
    along = np.array([_rotation(model.geom_quat[g])[:, 2] for g in geoms])
    return rr.Capsules3D(
        radii=model.geom_size[geoms, 0],
        lengths=2.0 * half,
        translations=model.geom_pos[geoms] - half[:, None] * along,
        quaternions=np.roll(model.geom_quat[geoms], -1, axis=1),
        **common,
    )


_BATCHES = {
    "boxes": ((mujoco.mjtGeom.mjGEOM_BOX,), _boxes),
    "ellipsoids": ((mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ELLIPSOID), _ellipsoids),
    "cylinders": ((mujoco.mjtGeom.mjGEOM_CYLINDER,), _cylinders),
    "capsules": ((mujoco.mjtGeom.mjGEOM_CAPSULE,), _capsules),
}


def mesh_of(model: mujoco.MjModel, geom: int) -> rr.Mesh3D:
    """A mesh geometry in the frame of its body."""
    mesh = int(model.geom_dataid[geom])
    vertices, faces = (
        slice(*_span(model.mesh_vertadr, model.mesh_vertnum, mesh)),
        slice(*_span(model.mesh_faceadr, model.mesh_facenum, mesh)),
    )
    rotation = _rotation(model.geom_quat[geom])
    triangles = model.mesh_face[faces]
    placed = model.mesh_vert[vertices] @ rotation.T + model.geom_pos[geom]
    return rr.Mesh3D(
        vertex_positions=placed,
        triangle_indices=triangles,
        vertex_normals=_normals(placed, triangles),
        albedo_factor=_colour(model, model.geom_rgba[geom], int(model.geom_matid[geom])),
    )


def _span(address: NDArray, count: NDArray, index: int) -> tuple[int, int]:
    return int(address[index]), int(address[index]) + int(count[index])


def _normals(vertices: NDArray, triangles: NDArray) -> NDArray[np.float64]:
    """Unit normals of the vertices ``(n, 3)``, averaged over the triangles they belong to by area."""
    corners = vertices[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices, dtype=float)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], faces)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0.0, length, 1.0)


class SkinSlice(NamedTuple):
    """A part of a skin and where it goes."""

    vertices: NDArray[np.float64]  # (n, 3) in the reference position
    triangles: NDArray[np.int64]  # (m, 3) into `vertices`
    normals: NDArray[np.float64]  # (n, 3)
    maps: NDArray[np.float64]  # (n_frames, 3, 4): the affine map of each frame


def skin_slices(model: mujoco.MjModel, skin: int, poses: BodyPoses) -> list[SkinSlice]:
    """The slices of a skin and their affine maps, by linear-blend skinning in closed form.

    A vertex at x goes to ``sum_b w_b(x) (A_b x + c_b)`` with the motions (A_b, c_b) of the bones. Its projection on
    affine maps is linear in these, so that one small matrix a bone and slice does for all frames.
    """
    rest = np.array(model.skin_vert[slice(*_span(model.skin_vertadr, model.skin_vertnum, skin))], dtype=float)
    triangles = np.array(model.skin_face[slice(*_span(model.skin_faceadr, model.skin_facenum, skin))])
    bones = range(*_span(model.skin_boneadr, model.skin_bonenum, skin))
    weights = np.zeros((len(bones), len(rest)))
    motions = np.empty((len(bones), len(poses.position), 3, 4))
    for i, bone in enumerate(bones):
        entries = slice(*_span(model.skin_bonevertadr, model.skin_bonevertnum, bone))
        weights[i, model.skin_bonevertid[entries]] = model.skin_bonevertweight[entries]
        body = int(model.skin_bonebodyid[bone])
        bind = _rotation(model.skin_bonebindquat[bone].astype(float))
        turn = np.array([_rotation(q) for q in poses.quaternion[:, body]]) @ bind.T
        motions[i, :, :, :3] = turn
        motions[i, :, :, 3] = poses.position[:, body] - turn @ model.skin_bonebindpos[bone]
    weights /= weights.sum(axis=0)
    turning = np.abs(motions[:, :, :, :3] - motions[:1, :, :, :3]).max() > 1e-6
    place = np.argsort(np.argsort(weights[0], kind="stable"), kind="stable") / len(rest)
    label = np.floor(place * (SETTINGS.skin_slices if turning else 1)).astype(int)
    slices = []
    for number in np.unique(label):
        faces = triangles[label[triangles].min(axis=1) == number]
        if not len(faces):
            continue
        used, local = np.unique(faces, return_inverse=True)
        homogeneous = np.column_stack([rest[used], np.ones(len(used))])
        project = np.linalg.pinv(homogeneous)
        maps = sum(
            motions[i] @ (project @ (weights[i, used, None] * homogeneous)).T for i in range(len(bones))
        )
        corners = local.reshape(faces.shape)
        slices.append(SkinSlice(rest[used], corners, _normals(rest[used], corners), np.asarray(maps)))
    return slices


def _matrices(matrices: NDArray) -> pa.Array:
    """Matrices ``(n, 3, 3)`` as rerun stores them, column by column; its own conversion takes 12 µs a matrix."""
    kind = rr.components.TransformMat3x3Batch(np.eye(3)).as_arrow_array().type
    flat = np.ascontiguousarray(matrices.transpose(0, 2, 1), dtype=np.float32).ravel()
    return pa.FixedSizeListArray.from_arrays(pa.array(flat), type=kind)


def _shown(model: mujoco.MjModel, body: int) -> list[int]:
    geoms = range(*_span(model.body_geomadr, model.body_geomnum, body))
    return [g for g in geoms if model.geom_group[g] < SETTINGS.visible_groups]


def log_scene(
    stream: rr.RecordingStream, path: Sequence[str], model: mujoco.MjModel, time: NDArray, poses: BodyPoses
) -> None:
    """Log a model's geometry once and its motion over time.

    Args:
        stream: Where to.
        path: Entity path of the rig, by parts.
        model: The compiled model.
        time: Times of the frames [s] (n_frames,).
        poses: Poses of the bodies at these times.
    """
    clock = [rr.TimeColumn("time", duration=time)]
    root = rr.new_entity_path(list(path))
    stream.log(root, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for body in range(model.nbody):
        geoms = _shown(model, body)
        if not geoms:
            continue
        name = model.body(body).name or f"body_{body}"
        _log_geometry(stream, [*path, name], model, geoms)
        entity = rr.new_entity_path([*path, name])
        quaternion = np.roll(poses.quaternion[:, body], -1, axis=1)
        if model.body_weldid[body] == 0:
            stream.log(
                entity,
                rr.Transform3D(
                    translation=poses.position[0, body], quaternion=rr.Quaternion(xyzw=quaternion[0])
                ),
                static=True,
            )
        else:
            columns = rr.Transform3D.columns(translation=poses.position[:, body], quaternion=quaternion)
            rr.send_columns(entity, clock, columns, recording=stream)
    for skin in range(model.nskin):
        if model.skin_group[skin] < SETTINGS.visible_groups:
            _log_skin(stream, path, model, skin, clock, poses)


def _log_geometry(
    stream: rr.RecordingStream, path: Sequence[str], model: mujoco.MjModel, geoms: list[int]
) -> None:
    for batch, (kinds, build) in _BATCHES.items():
        chosen = [g for g in geoms if int(model.geom_type[g]) in {int(kind) for kind in kinds}]
        if chosen:
            common = {
                "colors": _geom_colours(model, chosen),
                "labels": _names(model, chosen),
                "show_labels": False,
                "fill_mode": "solid",
            }
            stream.log(rr.new_entity_path([*path, batch]), build(model, chosen, common), static=True)
    for geom in geoms:
        if int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_MESH):
            stream.log(rr.new_entity_path([*path, *_names(model, [geom])]), mesh_of(model, geom), static=True)


def _log_skin(
    stream: rr.RecordingStream,
    path: Sequence[str],
    model: mujoco.MjModel,
    skin: int,
    clock: list[rr.TimeColumn],
    poses: BodyPoses,
) -> None:
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_SKIN, skin) or f"skin_{skin}"
    colour = _colour(model, model.skin_rgba[skin], int(model.skin_matid[skin]))
    for number, part in enumerate(skin_slices(model, skin, poses)):
        entity = rr.new_entity_path([*path, name, str(number)])
        mesh = rr.Mesh3D(
            vertex_positions=part.vertices,
            triangle_indices=part.triangles,
            vertex_normals=part.normals,
            albedo_factor=colour,
        )
        stream.log(entity, mesh, static=True)
        columns = rr.Transform3D.columns(
            translation=part.maps[:, :, 3], mat3x3=_matrices(part.maps[:, :, :3])
        )
        rr.send_columns(entity, clock, columns, recording=stream)


def eye_of(model: mujoco.MjModel, camera: str = "") -> Eye:
    """Where to look at a model from: a camera of the model, or a place to the front right and above.

    Args:
        model: The compiled model.
        camera: Name of a camera; the first one where empty.

    Raises:
        UnknownNameError: The model has no camera of that name.
    """
    centre, extent = model.stat.center, model.stat.extent
    names = [model.camera(i).name for i in range(model.ncam)]
    if camera and camera not in names:
        raise UnknownNameError("camera of the model", camera, names)
    found = names.index(camera) if camera else min(model.ncam, 1) - 1
    if found < 0:
        return Eye(centre + 1.3 * extent * np.array([-0.5, -0.9, 0.55]), np.array(centre))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    position, forward = data.cam_xpos[found], -data.cam_xmat[found].reshape(3, 3)[:, 2]
    distance = float(np.dot(centre - position, forward))
    distance = distance if distance > 0.0 else float(extent)
    target = position + distance * forward
    zoom = np.tan(0.5 * np.deg2rad(model.cam_fovy[found])) / np.tan(0.5 * SETTINGS.viewer_field_of_view)
    return Eye(target - SETTINGS.margin * zoom * distance * forward, target)
