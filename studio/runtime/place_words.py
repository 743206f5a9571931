"""Places of a project's file as a person in the window knows them: by their names, not by keys and numbers."""

from __future__ import annotations

import re

NAMED = re.compile(r"\bscene\.(?:rig\.lasers|objects|lights)\[\d+\] \(([^()]*)\)")
"""As renders and checks tell an item that has a name."""
NUMBERED = re.compile(r"\bscene\.(rig\.laser|object|light)s\[(\d+)\](?![.\[\w])")
OF_CAMERA = re.compile(r"\bscene\.rig\.camera\.(\w+)(?![.\[\w])")
WHOLE = re.compile(r"\bscene\.(?:rig\.)?(camera|lasers|objects|lights)(?![.\[\w])")


def in_words(text: str) -> str:
    """A message for the window. Fields deeper down stay as they are: the file is where they are looked for."""
    text = NAMED.sub(r"“\1”", text)
    text = NUMBERED.sub(lambda found: f"{found[1].removeprefix('rig.')} {int(found[2]) + 1}", text)
    return WHOLE.sub(r"the \1", OF_CAMERA.sub(r"the camera's \1", text))
