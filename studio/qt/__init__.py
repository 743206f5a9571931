"""The desktop: windows, panels and the 3D viewport over one document."""

from studio.qt.immortal import keep_alive

keep_alive()
