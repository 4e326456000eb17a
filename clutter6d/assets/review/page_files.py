"""The files of the page, as built by ``make web``, and the headers that keep it to itself."""

from functools import lru_cache
from importlib.resources import files

PAGE_FILES = {
    "": ("index.html", "text/html; charset=utf-8"),
    "review.js": ("review.js", "text/javascript; charset=utf-8"),
    "review.css": ("review.css", "text/css; charset=utf-8"),
    "icon.svg": ("icon.svg", "image/svg+xml"),
    "THIRD_PARTY.txt": ("THIRD_PARTY.txt", "text/plain; charset=utf-8"),
}
"""Below the secret path: each file that is served, and its type."""

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""Sent with every answer: nothing from elsewhere runs or is loaded, and nobody else may show or read the page."""


@lru_cache
def page_file(name: str) -> bytes:
    """The content of one file."""
    return files("clutter6d.assets.review").joinpath("static", name).read_bytes()
