"""Whether a window can open here, found out before Qt is loaded: Qt ends the whole process where it cannot."""

from __future__ import annotations

import ctypes
import os
import sys

INSTEAD = (
    "without a display use the commands: `main.py run PROJECT` scans and writes the report, "
    "`main.py --help` lists the others; over ssh, `ssh -X` brings a display"
)


def why_no_display() -> str | None:
    """The reason why no window can open, or None. Only X11 (and XWayland) is used on Linux."""
    if not sys.platform.startswith("linux"):
        return None
    if os.environ.get("QT_QPA_PLATFORM", "xcb").split(":")[0] != "xcb":
        return None  # chosen on purpose
    display = os.environ.get("DISPLAY")
    if not display:
        if os.environ.get("WAYLAND_DISPLAY"):
            return "this Wayland session has no XWayland, which the 3D view needs"
        return "there is no display"
    return None if _answers() else f"the display {display} does not answer"


def _answers() -> bool:
    try:
        xcb = ctypes.CDLL("libxcb.so.1")
    except OSError:
        return True  # the check of the system libraries names it
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connect.argtypes = [ctypes.c_char_p, ctypes.c_void_p]
    xcb.xcb_connection_has_error.argtypes = [ctypes.c_void_p]
    xcb.xcb_disconnect.argtypes = [ctypes.c_void_p]
    connection = xcb.xcb_connect(None, None)
    error = xcb.xcb_connection_has_error(connection)
    xcb.xcb_disconnect(connection)
    return not error
