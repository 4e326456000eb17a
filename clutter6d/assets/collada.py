"""What a COLLADA file would become, looked at before its parser, which follows every copy and turns NaN into 0."""

from typing import Any

import numpy as np
from lxml import etree

from clutter6d.errors import MeshRejectedError


def count_collada_vertices(content: bytes) -> int:
    """Vertices of a ``.dae`` file, each copy that its nodes make counted.

    Raises:
        MeshRejectedError: It is no such file, a node holds itself, or a vertex is NaN or infinite.
    """
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    try:
        root = etree.fromstring(content, parser)
        geometries = {f"#{item.get('id')}": _count_positions(item) for item in root.iter("{*}geometry")}
        nodes = {f"#{item.get('id')}": item for item in root.iter("{*}node")}
        scenes = root.iterfind("{*}library_visual_scenes/{*}visual_scene/{*}node")
        return sum(_Counter(geometries, nodes).below(node) for node in scenes)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise MeshRejectedError("unreadable", f"not a valid dae file ({str(error).splitlines()[0][:200]})") from None
    except RecursionError:
        raise MeshRejectedError("unreadable", "not a valid dae file (its nodes hold one another without end)") from None


class _Counter:
    """Adds up what stands below a node, each node once."""

    def __init__(self, geometries: dict[str, int], nodes: dict[str, Any]) -> None:
        self._geometries, self._nodes = geometries, nodes
        self._known: dict[str, int] = {}

    def below(self, node: Any) -> int:
        own = sum(self._geometries.get(item.get("url"), 0) for item in node.iterfind("{*}instance_geometry"))
        children = sum(self.below(child) for child in node.iterfind("{*}node"))
        return own + children + sum(self._named(item.get("url")) for item in node.iterfind("{*}instance_node"))

    def _named(self, url: str) -> int:
        if url not in self._known:
            self._known[url] = self.below(self._nodes[url]) if url in self._nodes else 0
        return self._known[url]


def _count_positions(geometry: Any) -> int:
    count = 0
    for position in geometry.iterfind(".//{*}vertices/{*}input[@semantic='POSITION']"):
        for source in geometry.iterfind(".//{*}source"):
            if f"#{source.get('id')}" == position.get("source"):
                numbers = np.array((source.findtext("{*}float_array") or "").split(), dtype=np.float64)
                if not np.isfinite(numbers).all():
                    raise MeshRejectedError("not-finite", "some vertices are NaN or infinite")
                count += len(numbers) // 3
    return count
