"""What the page is sent: plain JSON of what is said, and one binary block of what is measured.

The block holds, for each visual mesh and then for each convex part, its vertices (little-endian float32, x y z) and its
faces (little-endian uint32, three vertices each). The JSON says how many of each.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from clutter6d.assets.asset import Asset, Attributes, Licence, Mesh
from clutter6d.assets.attribute_change import MAX_FRICTION, MAX_MASS_KG, MAX_WORD_LENGTH
from clutter6d.assets.attributes import MATERIALS
from clutter6d.assets.review.entry import MAX_REASON_LENGTH, ReviewEntry
from clutter6d.assets.review.session import ReviewSession, ReviewStatus


def overview_payload(session: ReviewSession) -> dict[str, Any]:
    """The whole list of assets with the decision on each, and what a form needs to know."""
    status = session.status()
    return {
        "library": session.path.resolve().name,
        "reviewer": session.reviewer,
        "limits": {
            "mass_kg": MAX_MASS_KG,
            "friction": MAX_FRICTION,
            "word": MAX_WORD_LENGTH,
            "reason": MAX_REASON_LENGTH,
        },
        "materials": sorted(MATERIALS),
        "assets": [row_payload(status, name) for name in status.assets],
        "undoable": _undoable_payload(status.undoable),
    }


def decision_payload(session: ReviewSession, entry: ReviewEntry) -> dict[str, Any]:
    """What a decision, or its undoing, changed on the page."""
    status = session.status()
    return {
        "entry_id": entry.entry_id,
        "asset": row_payload(status, entry.asset_name),
        "undoable": _undoable_payload(status.undoable),
    }


def row_payload(status: ReviewStatus, name: str) -> dict[str, Any]:
    """One line of the list."""
    file, decision = status.assets[name], status.decision_on(name)
    return {
        "name": name,
        "hash": file.content_hash,
        "category": file.attributes.category,
        "decision": decision.decision if decision else None,
        "who": decision.who if decision else "",
        "when": decision.when.isoformat() if decision else "",
        "reason": decision.reason if decision else "",
    }


def asset_payload(asset: Asset) -> dict[str, Any]:
    """All that is known of one asset but its geometry; lengths in metres, quaternions from object to world frame."""
    quality, stable = asset.quality, asset.stable
    poses = zip(stable.quats_wxyz.tolist(), stable.heights_m.tolist(), stable.probabilities.tolist(), strict=True)
    return {
        "name": asset.name,
        "hash": asset.content_hash,
        "size_class": asset.size_class,
        "extents_m": asset.extents_m,
        "mass_kg": asset.mass_properties.mass_kg,
        "attributes": {name: getattr(asset.attributes, name) for name in Attributes.__slots__},
        "licence": {name: getattr(asset.licence, name) for name in Licence.__slots__},
        "quality": {
            "source_vertices": quality.source_vertices,
            "source_watertight": quality.source_watertight,
            "volume_ratio": quality.volume_ratio,
            "hull_volume_ratio": quality.hull_volume_ratio,
            "hausdorff_m": quality.hausdorff_m,
            "stable_candidates": quality.stable_candidates,
            "stable_verified": quality.stable_verified,
            "seconds": sum(quality.seconds.values()),
            "fallbacks": quality.fallbacks,
        },
        "symmetry": {
            "rotations": len(asset.symmetry.discrete_quats_wxyz),
            "has_axis": asset.symmetry.continuous_axis is not None,
        },
        "poses": [{"quat_wxyz": quat, "height_m": height, "probability": share} for quat, height, share in poses],
        "visual": [{**_counts(item.mesh), "rgba": item.rgba} for item in asset.visual],
        "parts": [_counts(part) for part in asset.parts],
    }


def geometry_block(asset: Asset) -> bytes:
    """The vertices and faces of an asset, as the page reads them."""
    meshes: Sequence[Mesh] = [*(item.mesh for item in asset.visual), *asset.parts]
    arrays = (array for mesh in meshes for array in (mesh.vertices.astype("<f4"), mesh.faces.astype("<u4")))
    return b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)


def _counts(mesh: Mesh) -> dict[str, int]:
    return {"vertices": len(mesh.vertices), "faces": len(mesh.faces)}


def _undoable_payload(entry: ReviewEntry | None) -> dict[str, str] | None:
    if entry is None:
        return None
    return {"entry_id": entry.entry_id, "decision": entry.decision, "asset_name": entry.asset_name}
