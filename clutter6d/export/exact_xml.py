"""MJCF text without loss: MuJoCo writes six digits of a number, this writes as many as bring it back to the bit."""

import mujoco
import numpy as np
from jaxtyping import Num
from lxml import etree


def exact_xml(spec: mujoco.MjSpec, model: mujoco.MjModel) -> bytes:
    """A specification as MJCF, with exact poses, masses, inertias, shapes and keyframes.

    Args:
        spec: The specification.
        model: What it compiles to.
    """
    root = etree.fromstring(spec.to_xml().encode(), etree.XMLParser(huge_tree=True, resolve_entities=False))
    for element in root.iter("mesh"):
        element.set("vertex", _text(np.array(spec.mesh(element.get("name")).uservert, dtype=np.float32)))
    for element in root.iter("body"):
        body = model.body(element.get("name"))
        if not model.body_mocapid[body.id] >= 0:
            _set(element, pos=body.pos, quat=body.quat)
        for inertial in element.iterchildren("inertial"):
            _set(inertial, pos=body.ipos, quat=body.iquat, mass=body.mass, diaginertia=body.inertia)
    for element in root.iter("geom"):
        if element.get("name") and not element.get("mesh"):
            geom = model.geom(element.get("name"))
            sizes = len(element.get("size").split())
            _set(element, pos=geom.pos, quat=geom.quat, size=geom.size[:sizes])
    for number, element in enumerate(root.iter("key")):
        key = model.key(number)
        _set(element, qpos=key.qpos, ctrl=key.ctrl, mpos=key.mpos, mquat=key.mquat)
    return etree.tostring(root)


def _set(element: etree._Element, **values: Num[np.ndarray, "..."]) -> None:
    for name, value in values.items():
        element.set(name, _text(np.ravel(value)))


def _text(values: Num[np.ndarray, "value"]) -> str:
    """Numbers as short as brings them back exactly."""
    return " ".join(values.astype(str))
