"""Licences travel with every export: ``LICENCES.csv`` names terms, author and origin of every object."""

import csv
import io
from collections.abc import Mapping

from clutter6d.assets.asset import Asset
from clutter6d.scene import Scene


def licence_table(scene: Scene, assets: Mapping[str, Asset]) -> bytes:
    """CSV with one row an object: its name, asset, licence, author, source and address."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["object", "asset", "licence", "author", "source", "source_id", "url"])
    for item in scene.objects:
        licence = assets[item.asset_hash].licence
        origin = (licence.name, licence.author, licence.source, licence.source_id, licence.url)
        writer.writerow([item.name, item.asset_name, *origin])
    return text.getvalue().encode()
