"""Where the picture is taken from."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64


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


SCENE_VIEW = Camera(look_at_m=(-0.14, 0.0, 0.16), distance_m=2.35, azimuth_deg=142.0, elevation_deg=-27.0)
"""Table and arm, from the far right corner."""

TABLE_VIEW = Camera(look_at_m=(-0.08, 0.0, 0.04), distance_m=1.45, azimuth_deg=165.0, elevation_deg=-40.0)
"""The objects, from the side opposite the arm."""

EPISODE_VIEW = Camera(look_at_m=(-0.12, 0.0, 0.20), distance_m=2.05, azimuth_deg=150.0, elevation_deg=-25.0)
"""Hand and objects, closer than the scene's view."""

ROBOT_VIEW = Camera(look_at_m=(-0.35, 0.0, 0.38), distance_m=1.75, azimuth_deg=120.0, elevation_deg=-12.0)
"""The arm, from the side."""
