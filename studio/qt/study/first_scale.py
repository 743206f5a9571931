"""The image scale of a new study, by the line of the open project: beside the window, as a first look takes long."""

from __future__ import annotations

from typing import TYPE_CHECKING

from studio.study.draft import new_draft
from studio.study.small_images import first_scale

if TYPE_CHECKING:
    from studio.qt.study.study_work import StudyWork

LANE = "scale"


class FirstScale:
    """Looked for once for each new study; one that is loaded, or that was kept, has its own."""

    def __init__(self, work: StudyWork) -> None:
        self._work = work
        self.begin()

    def begin(self) -> None:
        """Another draft is there; what is still looked for was for the one before."""
        self._work.unseen.cancel(LANE)
        self._wanted = self._work.draft == new_draft(self._work.base_name)

    def look(self) -> None:
        """Once someone looks at the draft."""
        if not self._wanted or not self._work.watched:
            return
        self._wanted = False
        work = self._work
        project, now = work.session.project.in_folder(work.session.document.root), work.draft["image_scale"]

        def then(scale: float) -> None:
            chosen = work.draft.get("image_scale") != now or work.running or work.found is not None
            if not chosen and scale != now:
                work.put({**work.draft, "image_scale": scale})

        work.unseen.run(LANE, "look at the line", lambda *_: first_scale(project, work.draft.get("laser", 0)), then)
