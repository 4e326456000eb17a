"""Checks every certificate of a scene set from its exported MJCF alone, with plain MuJoCo and none of our code.

    clutter6d generate --track sparse --scenes 16 --out scenes --export mjcf
    python examples/check_exported_scenes.py scenes

For every goal pair: no contact deeper than 1 mm; no object moves more than 1 mm or 1 degree in 1 s; every relation of
the scene graph holds; the goal pose touches nothing but the table, and holds too. Exits with 1 if anything fails.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

PENETRATION_M, DRIFT_M, DRIFT_RAD = 1e-3, 1e-3, np.deg2rad(1.0)
NEAR_GAP_M, REACH_M, OFF_AXIS_M, SHARE = 0.08, 0.45, 0.10, (0.2, 0.8)
SECOND = 200


def check_scene(scene: dict, model: mujoco.MjModel) -> list[str]:
    """Problems of one scene, one line each."""
    problems = []
    for number, pair in enumerate(scene["goal_pairs"]):
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, model.key(f"pair_{number}").id)
        problems += [f"pair {number}: {problem}" for problem in check_state(scene, model, data)]
        mujoco.mj_resetDataKeyframe(model, data, model.key(f"pair_{number}").id)
        address = model.joint("target_joint").qposadr[0]
        goal = pair["goal"]
        data.qpos[address : address + 7] = goal["position"] + goal["quat_wxyz"]
        problems += [f"pair {number}, goal: {problem}" for problem in check_state(scene, model, data)]
    return problems


def check_state(scene: dict, model: mujoco.MjModel, data: mujoco.MjData) -> list[str]:
    """Problems of one state: contacts, relations, and what moves within a second."""
    problems = []
    mujoco.mj_forward(model, data)
    depth = max((-contact.dist for contact in data.contact), default=0.0)
    if depth > PENETRATION_M:
        problems.append(f"penetration {1000 * depth:.2f} mm")
    problems += [f"broken: {relation}" for relation in scene["relations"] if not holds(relation, model, data)]
    names = [item["name"] for item in scene["objects"]]
    before = {name: (data.body(name).xpos.copy(), data.body(name).xquat.copy()) for name in names}
    data.ctrl[:] = data.qpos[:7]
    for _ in range(SECOND):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    for name, (position, quat) in before.items():
        moved = np.linalg.norm(data.body(name).xpos - position)
        turned = 2 * np.arccos(min(1.0, abs(float(data.body(name).xquat @ quat))))
        if moved > DRIFT_M or turned > DRIFT_RAD:
            problems.append(f"{name} moved {1000 * moved:.2f} mm, {np.rad2deg(turned):.2f} degrees")
    return problems


def holds(relation: dict, model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Whether one relation holds, from positions and geometry alone."""
    subject, reference = relation["subject"], relation["reference"]
    if relation["kind"] == "on":
        carrier = "world" if reference == "table" else reference
        bodies = {model.body(subject).id, model.body(carrier).id}
        return any({model.geom_bodyid[geom] for geom in contact.geom} == bodies for contact in data.contact)
    offset = (data.body(subject).xpos - data.body(reference).xpos)[:2]
    if relation["kind"] == "near":
        return planar_gap(footprint(subject, model, data), footprint(reference, model, data)) <= NEAR_GAP_M
    if relation["kind"] == "between":
        axis = (data.body(relation["second_reference"]).xpos - data.body(reference).xpos)[:2]
        along = offset @ axis / (axis @ axis)
        off_axis = abs(offset[0] * axis[1] - offset[1] * axis[0]) / np.linalg.norm(axis)
        return SHARE[0] <= along <= SHARE[1] and off_axis <= OFF_AXIS_M
    ahead, aside = {
        "left_of": (offset[1], offset[0]),
        "right_of": (-offset[1], offset[0]),
        "in_front_of": (-offset[0], offset[1]),
        "behind": (offset[0], offset[1]),
    }[relation["kind"]]
    return ahead >= abs(aside) and np.linalg.norm(offset) <= REACH_M


def footprint(name: str, model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Corners of the shadow of an object's collision geometry, counter-clockwise (corner, 2)."""
    points = []
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom] == model.body(name).id and model.geom_contype[geom]:
            mesh = model.geom_dataid[geom]
            start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            corners = model.mesh_vert[start : start + count] @ data.geom_xmat[geom].reshape(3, 3).T
            points.append((corners + data.geom_xpos[geom])[:, :2])
    shadow = np.concatenate(points)
    return shadow[ConvexHull(shadow).vertices]


def planar_gap(first: np.ndarray, second: np.ndarray) -> float:
    """Distance between two convex polygons that are apart: the smallest from a corner to an edge."""
    return min(corner_to_edges(first, second), corner_to_edges(second, first))


def corner_to_edges(corners: np.ndarray, polygon: np.ndarray) -> float:
    """Smallest distance from any corner to any edge of a polygon."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    offsets = corners[:, None] - polygon[None]
    share = np.clip((offsets * edges).sum(-1) / (edges * edges).sum(-1), 0, 1)
    return float(np.linalg.norm(offsets - share[..., None] * edges, axis=-1).min())


def main(folder: Path) -> int:
    """Check all scenes of a set that were exported; returns the exit code."""
    bad = 0
    exported = sorted(folder.glob("mjcf/*/scene.xml"))
    for path in exported:
        scene = json.loads((folder / "scenes" / path.parent.name / "scene.json").read_text())
        problems = check_scene(scene, mujoco.MjModel.from_xml_path(str(path)))
        bad += bool(problems)
        good = f"{len(scene['goal_pairs'])} pairs, {len(scene['relations'])} relations hold"
        print(f"{path.parent.name}: {'; '.join(problems) or good}")
    print(f"{len(exported) - bad} of {len(exported)} certificates hold")
    return 1 if bad or not exported else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
