"""Predicted against true motion, drawn (paper, Figure "Visualization of our world model predictions")."""

import importlib
import io
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import torch
from jaxtyping import Bool, Float

from clutter6d.errors import InvalidValueError, MissingDependencyError
from clutter6d.seeding import generator
from dapl_baselines.interactions.dataset import InteractionData, Transitions
from dapl_baselines.patches import END_EFFECTOR, ENVIRONMENT, TARGET
from dapl_baselines.world_model.batches import Batch
from dapl_baselines.world_model.metrics import chamfer_distances, floor_positions, points_in
from dapl_baselines.world_model.model import WorldModel

_MOVING_POINTS: Final = 128
"""A transition is drawn if so many points of objects move."""
_DRAWN_ARROWS: Final = 80
_STRETCH: Final = 3.0
"""Displacements are drawn so many times as long: a centimetre is little among objects of 10 to 30."""
_PARTS: Final = ((TARGET, "#4c72b0"), (ENVIRONMENT, "#999999"), (END_EFFECTOR, "#c9a66b"))
_COLUMNS: Final = {"true": "#2a7f3f", "model": "#c44e00", "constant velocity": "#7f3f98"}

Points = Float[np.ndarray, "point 3"]


def draw_predictions(model: WorldModel, data: InteractionData, count: int, seed: int) -> bytes:
    """A PNG with a row for each of some held-out transitions: true motion, the model's, and constant velocity.

    Args:
        model: The model, in evaluation mode.
        data: Where the transitions are.
        count: Rows.
        seed: Of the choice of transitions.

    Raises:
        InvalidValueError: There are not so many transitions in which objects move.
        MissingDependencyError: matplotlib is not installed.
    """
    check_matplotlib()
    batch = _choose(data, count, seed)
    device = next(model.parameters()).device
    with torch.inference_mode():
        predicted = model(batch.now.to(device), batch.flow.to(device)).positions.float().cpu()
    now, later = batch.now[..., :3], batch.later[..., :3]
    columns = {"true": later, "model": predicted, "constant velocity": floor_positions(batch.now)["constant_velocity"]}
    moving = points_in("moving_objects", now, later)
    errors = {name: 100 * chamfer_distances(positions, later, moving) for name, positions in columns.items()}
    return _draw(now.numpy(), {name: each.numpy() for name, each in columns.items()}, moving.numpy(), errors)


def check_matplotlib() -> None:
    """See that pictures can be drawn.

    Raises:
        MissingDependencyError: matplotlib is not installed.
    """
    try:
        importlib.import_module("matplotlib.figure")
    except ImportError:
        raise MissingDependencyError(
            'a picture needs matplotlib, which is not installed; run: pip install "clutter6d[card]"'
        ) from None


def _choose(data: InteractionData, count: int, seed: int) -> Batch:
    """Held-out transitions in which many points of objects move."""
    candidates: Transitions = data.validation[data.validation.is_moving]
    order = generator(seed, "picture").permutation(len(candidates))[: 16 * count]
    batch = Batch.of(data.clouds(candidates[order]))
    moving = points_in("moving_objects", batch.now[..., :3], batch.later[..., :3]).sum(dim=1)
    rows = torch.nonzero(moving >= _MOVING_POINTS)[:count, 0]
    if len(rows) < count:
        raise InvalidValueError(f"objects move in {len(rows)} of {len(order)} held-out transitions; choose fewer rows")
    return Batch(now=batch.now[rows], later=batch.later[rows], flow=batch.flow[rows])


def _draw(
    now: Float[np.ndarray, "row point 3"],
    columns: Mapping[str, Float[np.ndarray, "row point 3"]],
    moving: Bool[np.ndarray, "row point"],
    errors: Mapping[str, torch.Tensor],
) -> bytes:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4 * len(columns), 3.6 * len(now)), layout="constrained")
    for row in range(len(now)):
        for column, (name, positions) in enumerate(columns.items()):
            axes: Any = figure.add_subplot(len(now), len(columns), row * len(columns) + column + 1, projection="3d")
            _draw_scene(axes, now[row], moving[row])
            _draw_motion(axes, now[row][moving[row]], positions[row][moving[row]], _COLUMNS[name])
            error = "" if name == "true" else f", P.E. {float(errors[name][row]):.2f} cm"
            axes.set_title(f"{name}{error}", fontsize=10)
    figure.suptitle(f"Motion of points of objects in 0.1 s on held-out scenes, {_STRETCH:.0f} times as long")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    return buffer.getvalue()


def _draw_scene(axes: Any, points: Points, moving: Bool[np.ndarray, "point"]) -> None:
    """All points, with the view on those that move."""
    centre = points[moving].mean(axis=0)
    reach = max(0.12, 1.3 * float(np.abs(points[moving] - centre).max()))
    near = (np.abs(points - centre) < reach).all(axis=1)
    for component, colour in _PARTS:
        shown = points[component.of_cloud][near[component.of_cloud]]
        axes.scatter(*shown.T, s=4, c=colour, alpha=0.5, depthshade=False, linewidths=0)
    x, y, z = ((middle - reach, middle + reach) for middle in centre.tolist())
    axes.set(xlim=x, ylim=y, zlim=z)
    axes.set_box_aspect((1, 1, 1), zoom=1.4)
    axes.view_init(elev=35, azim=-60)
    axes.set_axis_off()


def _draw_motion(axes: Any, before: Points, after: Points, colour: str) -> None:
    drawn = slice(None, None, max(1, len(before) // _DRAWN_ARROWS))
    axes.quiver(
        *before[drawn].T,
        *(_STRETCH * (after[drawn] - before[drawn])).T,
        color=colour,
        linewidth=0.9,
        arrow_length_ratio=0.25,
    )
