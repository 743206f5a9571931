"""The one error that a person sees: what, where, what was found, what is allowed, what to do."""

from __future__ import annotations


class InputError(ValueError):
    """A bad input, reported in one message; the command line prints it and exits with code 2.

    what: what is wrong, a short clause ("albedo is out of range").
    where: file, field or object it concerns ("weld.json: scene.objects[0].material.albedo").
    found / allowed / cure: optional parts of the message.
    """

    def __init__(self, what: str, *, where: str = "", found: object = None, allowed: str = "", cure: str = "") -> None:
        self.what, self.where, self.found, self.allowed, self.cure = what, where, found, allowed, cure
        where = where.replace("\n", "\\n")  # a file may be so named; lines of a message are its own
        parts = [f"{where}: {what}" if where else what]
        if found is not None:
            text = str(found)
            parts.append(f"found {text if len(text) <= 120 else text[:117] + '...'}")
        if allowed:
            parts.append(f"allowed: {allowed}")
        if cure:
            parts.append(cure)
        super().__init__("; ".join(parts))


class Cancelled(Exception):  # noqa: N818 - a request, not an error
    """The user asked a long step to stop."""
