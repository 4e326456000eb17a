"""Names that are safe as file names and in MuJoCo models."""

import re
import unicodedata

MAX_LENGTH = 60


def slugify(name: str) -> str:
    """Lower-case ASCII letters and digits joined by hyphens; never empty."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "-", plain.lower()).strip("-")[:MAX_LENGTH].strip("-") or "object"
