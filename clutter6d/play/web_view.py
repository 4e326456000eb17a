"""A live view as a page in the browser, by viser."""

import html
from collections.abc import Mapping, Sequence
from queue import SimpleQueue
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from clutter6d.assets.asset import Asset
from clutter6d.play.live_view import Action, drain
from clutter6d.play.shapes import Shape, visible_shapes
from clutter6d.play.web_server import close_server, open_server
from clutter6d.render.camera import EPISODE_VIEW, ROBOT_VIEW, SCENE_VIEW, TABLE_VIEW, Camera
from clutter6d.render.scene_picture import picture_model
from clutter6d.render.studio import FILL_DIRECTION, KEY_DIRECTION
from clutter6d.scene import Scene

if TYPE_CHECKING:
    import viser

CAMERAS = {"scene": SCENE_VIEW, "table": TABLE_VIEW, "episode": EPISODE_VIEW, "robot": ROBOT_VIEW}
POINT_SIZE_M = 0.004
_SKY = (238, 242, 246)


class WebView:
    """A page that shows one scene at a time to everyone who opens it.

    Args:
        host: Address to listen at.
        port: Its port; 0 for any free one.

    Attributes:
        server: viser's server, for controls beyond those that are offered.

    Raises:
        MissingDependencyError: viser is not installed.
        InvalidValueError: The page cannot listen there.
    """

    is_open = True

    def __init__(self, *, host: str = "127.0.0.1", port: int = 0) -> None:
        self.server = open_server(host, port)
        self._host = host
        self._triggered: SimpleQueue[str] = SimpleQueue()
        self._bodies: dict[int, viser.FrameHandle] = {}
        self._points: viser.PointCloudHandle | None = None
        self._data: mujoco.MjData | None = None
        self._prepare_page()
        self._text = self.server.gui.add_html("")

    @property
    def url(self) -> str:
        """Where the page is."""
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{host}:{self.server.get_port()}"

    @property
    def is_watched(self) -> bool:
        """Whether the page is open anywhere."""
        return bool(self.server.get_clients())

    def offer(self, actions: Sequence[Action]) -> None:
        """A button and a key for each action."""
        names = {action.label: action.name for action in actions if action.has_button}
        hint = ", ".join(f"{action.label}: {action.key}" for action in actions)
        buttons = self.server.gui.add_button_group("Controls", list(names), hint=hint)
        buttons.on_click(lambda event: self._trigger(names.get(event.target.value)))
        for action in actions:
            command = self.server.gui.add_command(action.label, hotkey=action.key)  # pyright: ignore
            command.on_trigger(lambda _, name=action.name: self._trigger(name))

    def _trigger(self, name: str | None) -> None:
        if name:
            self._triggered.put(name)

    def triggered(self) -> tuple[str, ...]:
        """Names of the actions asked for since the last call."""
        return drain(self._triggered)

    def show(self, scene: Scene, assets: Mapping[str, Asset], pair: int = 0) -> None:
        """Show a goal pair of a scene at its start, instead of what was shown."""
        picture = picture_model(scene, assets, pair)
        self._data = mujoco.MjData(picture.model)
        shapes = visible_shapes(picture.model)
        with self.server.atomic():
            for body in self._bodies.values():
                body.remove()
            self._bodies = {body: self._add_body(body) for body in sorted({shape.body for shape in shapes})}
            for index, shape in enumerate(shapes):
                self._add_shape(f"{_body_name(shape.body)}/{index}", shape)
            self.update(picture.initial_qpos)

    def update(self, qpos: Float64[np.ndarray, "nq"]) -> None:
        """Move everything, in one message to every page."""
        assert self._data is not None, "show a scene first"
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._data.model, self._data)
        with self.server.atomic():
            for body, frame in self._bodies.items():
                frame.position = self._data.xpos[body]
                frame.wxyz = self._data.xquat[body]
        self.server.flush()

    def draw_points(self, points: Float32[np.ndarray, "point 3"], rgb: UInt8[np.ndarray, "point 3"]) -> None:
        """Draw points instead of those drawn before."""
        with self.server.atomic():
            if self._points is not None:
                self._points.visible = bool(len(points))
            if not len(points):
                return
            if self._points is None:
                self._points = self.server.scene.add_point_cloud(
                    "/points", points, rgb, point_size=POINT_SIZE_M, point_shape="circle", precision="float32"
                )
            self._points.points, self._points.colors = points, rgb

    def message(self, text: str) -> None:
        """Show lines of text above the controls."""
        self._text.content = _table(text)

    def look_from(self, camera: Camera) -> None:
        """Place the camera of every page."""
        for client in self.server.get_clients().values():
            with client.atomic():
                client.camera.position = camera.position()
                client.camera.look_at = np.array(camera.look_at_m)
                client.camera.fov = float(np.deg2rad(camera.vertical_fov_deg))

    def close(self) -> None:
        """Stop the server."""
        self.is_open = False
        close_server(self.server)

    def _prepare_page(self) -> None:
        self.server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        self.server.gui.set_panel_label("Clutter6D")
        self.server.gui.main_panel.dock_right()
        start = self.server.initial_camera
        start.position, start.look_at = EPISODE_VIEW.position(), np.array(EPISODE_VIEW.look_at_m)
        start.fov = float(np.deg2rad(EPISODE_VIEW.vertical_fov_deg))
        start.near = 0.02
        scene = self.server.scene
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map(environment_intensity=0.6)
        scene.add_light_directional("/key", position=tuple(3 * KEY_DIRECTION), intensity=2.2, cast_shadow=True)
        scene.add_light_directional("/fill", position=tuple(FILL_DIRECTION), intensity=0.5)
        scene.set_background_image(np.full((8, 8, 3), _SKY, dtype=np.uint8))

    def _add_body(self, body: int) -> "viser.FrameHandle":
        return self.server.scene.add_frame(_body_name(body), show_axes=False)

    def _add_shape(self, name: str, shape: Shape) -> None:
        is_solid = shape.opacity >= 1
        self.server.scene.add_mesh_simple(
            name,
            shape.vertices.astype(np.float32),
            shape.faces.astype(np.uint32),
            color=shape.rgb,
            opacity=None if is_solid else shape.opacity,
            cast_shadow=is_solid,
            receive_shadow=is_solid,
        )


def _body_name(body: int) -> str:
    return f"/scene/body{body}"


def _table(text: str) -> str:
    """Lines as rows, and tabs as the borders of cells; all of it as plain text."""
    rows = "".join(
        "<tr>"
        + "".join(
            f"<td style='padding:1px 8px 1px 0;vertical-align:top'>{html.escape(cell)}</td>"
            for cell in line.split("\t")
        )
        + "</tr>"
        for line in text.splitlines()
    )
    return f"<table data-readout style='font-size:0.85em;margin:0.5em 1em'>{rows}</table>"
