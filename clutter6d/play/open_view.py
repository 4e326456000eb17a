"""Choosing the window: a page in the browser, or MuJoCo's viewer."""

from clutter6d.errors import UnknownNameError
from clutter6d.play.live_view import has_display
from clutter6d.play.native_view import NativeView
from clutter6d.play.web_view import WebView

VIEWERS = ("auto", "web", "native")


def open_view(viewer: str = "auto", *, host: str = "127.0.0.1", port: int = 0) -> WebView | NativeView:
    """Open a window on nothing yet.

    Args:
        viewer: ``web``: a page on this machine; ``native``: MuJoCo's viewer; ``auto``: the latter where there is a
            display, the former elsewhere.
        host: Address that the page listens at.
        port: Its port; 0 for any free one.

    Raises:
        UnknownNameError: There is no such viewer.
        MissingDependencyError: The page needs viser, the native viewer a display.
        InvalidValueError: The page cannot listen there.
    """
    if viewer not in VIEWERS:
        raise UnknownNameError("viewer", viewer, VIEWERS)
    if viewer == "native" or (viewer == "auto" and has_display()):
        return NativeView()
    return WebView(host=host, port=port)
