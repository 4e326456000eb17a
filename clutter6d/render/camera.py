"""Where the picture is taken from."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float64

from clutter6d.geometry import Pose, quat_from_matrix


@dataclass(frozen=True, kw_only=True, slots=True)
class Camera:
    """A camera that looks at a point from a distance, upright.

    Attributes:
        look_at_m: The point in the middle of the picture, world frame.
        distance_m: From that point to the camera.
        azimuth_deg: Direction of view about the vertical; 0 looks along +x, 90 along +y.
        elevation_deg: Direction of view against the horizontal; negative looks down.
        vertical_fov_deg: Angle of view from the picture's lower to its upper edge.
    """

    look_at_m: tuple[float, float, float]
    distance_m: float
    azimuth_deg: float
    elevation_deg: float
    vertical_fov_deg: float = 35.0

    def forward(self) -> Float64[np.ndarray, "3"]:
        """Unit direction of view."""
        azimuth, elevation = np.deg2rad([self.azimuth_deg, self.elevation_deg])
        flat = np.cos(elevation)
        return np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])

    def position(self) -> Float64[np.ndarray, "3"]:
        """Position of the camera, world frame [m]."""
        return np.array(self.look_at_m) - self.distance_m * self.forward()

    def rotation_camera_to_world(self) -> Float64[np.ndarray, "3 3"]:
        """The camera's axes as columns, as OpenCV has them: x right, y down, z along the view."""
        forward = self.forward()
        right = np.array([forward[1], -forward[0], 0.0]) / np.hypot(forward[0], forward[1])
        return np.stack([right, np.cross(forward, right), forward], axis=1)

    def pose_camera_to_world(self) -> Pose:
        """Pose of the camera's frame, whose axes are OpenCV's: x right, y down, z along the view."""
        quat = quat_from_matrix(self.rotation_camera_to_world())
        return Pose.from_row(np.concatenate([self.position(), quat]))

    def intrinsics(self, width: int, height: int) -> Float64[np.ndarray, "3 3"]:
        """The camera matrix of pictures of a size [px]; a pixel's centre has whole numbers, the first one's (0, 0)."""
        focal = height / 2 / np.tan(np.deg2rad(self.vertical_fov_deg) / 2)
        return np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])

    def back_project(self, depth_m: Float[np.ndarray, "height width"]) -> Float64[np.ndarray, "height width 3"]:
        """What each pixel of a depth picture sees, world frame [m]; meaningless where the depth is 0.

        Args:
            depth_m: Depth along the optical axis [m].
        """
        height, width = depth_m.shape
        matrix = self.intrinsics(width, height)
        row, column = np.indices(depth_m.shape)
        rays = np.stack([(column - matrix[0, 2]) / matrix[0, 0], (row - matrix[1, 2]) / matrix[1, 1]], axis=-1)
        local = np.concatenate([rays, np.ones((height, width, 1))], axis=-1) * depth_m[..., None]
        return local @ self.rotation_camera_to_world().T + self.position()


SCENE_VIEW = Camera(look_at_m=(-0.14, 0.0, 0.16), distance_m=2.35, azimuth_deg=142.0, elevation_deg=-27.0)
"""Table and arm, from the far right corner."""

TABLE_VIEW = Camera(look_at_m=(-0.08, 0.0, 0.04), distance_m=1.45, azimuth_deg=165.0, elevation_deg=-40.0)
"""The objects, from the side opposite the arm."""

EPISODE_VIEW = Camera(look_at_m=(-0.12, 0.0, 0.20), distance_m=2.05, azimuth_deg=150.0, elevation_deg=-25.0)
"""Hand and objects, closer than the scene's view."""

ROBOT_VIEW = Camera(look_at_m=(-0.35, 0.0, 0.38), distance_m=1.75, azimuth_deg=120.0, elevation_deg=-12.0)
"""The arm, from the side."""
