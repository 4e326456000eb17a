"""Pictures of assets: each alone on a light floor, in its most probable resting orientation."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice

import mujoco
import numpy as np
from PIL.Image import Image as PilImage

from clutter6d.assets.asset import Asset
from clutter6d.assets.mujoco_body import add_mesh
from clutter6d.geometry import rotate
from clutter6d.physics import VISUAL_GROUP
from clutter6d.render.camera import Camera
from clutter6d.render.picture import Image, open_renderer
from clutter6d.render.sheet import contact_sheet
from clutter6d.render.studio import add_sky_and_light

_OUT_OF_SIGHT = (0.0, 0.0, -100.0, 1.0, 0.0, 0.0, 0.0)
_ASSETS_PER_MODEL = 24
_AZIMUTH_DEG, _ELEVATION_DEG = 140.0, -28.0
_MARGIN = 1.15


def render_assets(assets: Iterable[Asset], *, columns: int = 8, size_px: int = 200, backend: str = "auto") -> PilImage:
    """A contact sheet of assets, each with its name, filling its picture whatever its size.

    Args:
        assets: At least one; read as they are drawn.
        columns: Pictures in a row.
        size_px: Side of a picture [px].
        backend: As for :func:`clutter6d.render.picture.open_renderer`.

    Raises:
        InvalidValueError: No assets.
    """
    images: list[Image] = []
    labels: list[str] = []
    for asset, image in asset_pictures(assets, size_px=size_px, backend=backend):
        images.append(image)
        labels.append(f"{asset.name}, {100 * asset.longest_extent_m:.0f} cm")
    return contact_sheet(images, labels, columns)


def asset_pictures(
    assets: Iterable[Asset], *, size_px: int = 200, backend: str = "auto"
) -> Iterator[tuple[Asset, Image]]:
    """Each asset with its picture, in order."""
    waiting = iter(assets)
    while group := tuple(islice(waiting, _ASSETS_PER_MODEL)):
        model = _model_of(group)
        with open_renderer(model, width=size_px, height=size_px, backend=backend) as renderer:
            for index, asset in enumerate(group):
                poses = np.tile(_OUT_OF_SIGHT, (len(group), 1))
                poses[index] = (0, 0, asset.stable.heights_m[0], *asset.stable.quats_wxyz[0])
                yield asset, renderer.draw(poses.ravel(), _camera_of(asset))


def asset_views(
    asset: Asset, angles_deg: Sequence[tuple[float, float]], *, size_px: int = 384, backend: str = "auto"
) -> tuple[Image, ...]:
    """Pictures of one asset from several sides.

    Args:
        asset: Shown in its most probable resting orientation.
        angles_deg: Azimuth and elevation of each view, as :class:`clutter6d.render.camera.Camera` has them.
        size_px: Side of a picture [px].
        backend: As for :func:`clutter6d.render.picture.open_renderer`.
    """
    pose = np.array((0, 0, asset.stable.heights_m[0], *asset.stable.quats_wxyz[0]))
    with open_renderer(_model_of((asset,)), width=size_px, height=size_px, backend=backend) as renderer:
        return tuple(renderer.draw(pose, _camera_of(asset, *angles)) for angles in angles_deg)


def _camera_of(asset: Asset, azimuth_deg: float = _AZIMUTH_DEG, elevation_deg: float = _ELEVATION_DEG) -> Camera:
    """A camera from which the asset, in its first resting orientation, fills the picture."""
    points = rotate(asset.stable.quats_wxyz[0], asset.surface_points.astype(np.float64))
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    look_at = (float(centre[0]), float(centre[1]), float(centre[2] + asset.stable.heights_m[0]))
    view = Camera(look_at_m=look_at, distance_m=1.0, azimuth_deg=azimuth_deg, elevation_deg=elevation_deg)
    forward = view.forward()
    depth = (points - centre) @ forward
    right = np.array([forward[1], -forward[0], 0.0]) / np.hypot(forward[0], forward[1])
    sideways, upward = (points - centre) @ right, (points - centre) @ np.cross(right, forward)
    aside = np.maximum(np.abs(sideways), np.abs(upward)) / np.tan(np.deg2rad(view.vertical_fov_deg) / 2)
    return replace(view, distance_m=_MARGIN * float((aside - depth).max()))


def _model_of(assets: Sequence[Asset]) -> mujoco.MjModel:
    """All assets of a picture's model as free bodies; one at a time is brought to the origin."""
    spec = mujoco.MjSpec()
    add_sky_and_light(spec)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 0.1), rgba=(0.86, 0.87, 0.88, 1), group=VISUAL_GROUP
    )
    for number, asset in enumerate(assets):
        body = spec.worldbody.add_body(name=f"asset{number}", explicitinertial=True, mass=1, inertia=(1, 1, 1))
        body.add_freejoint()
        for index, visual in enumerate(asset.visual):
            name = f"asset{number}_visual{index}"
            add_mesh(spec, name, visual.mesh)
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=name,
                rgba=visual.rgba,
                group=VISUAL_GROUP,
                contype=0,
                conaffinity=0,
                mass=0,
            )
    return spec.compile()
