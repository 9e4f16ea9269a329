"""The draft and what it was before: undo, redo, and which edit is the newest."""

from __future__ import annotations

import msgspec

from operator_panel.teach.draft import Draft, TeachError

MOST = 200
"""Edits that can be undone; our choice: a program of 100 lines takes as many."""


class Edits(msgspec.Struct, frozen=True):
    """A draft with its past.

    Attributes:
        draft: As it is now.
        chosen: Number of the line that the edit has left chosen; 0: none.
        before: What undo leads back to, the oldest first, with the line that was chosen.
        undone: What redo leads forward to, likewise.
        version: Grows with each change, so that all pages know the newest.
    """

    draft: Draft
    chosen: int = 0
    before: tuple[tuple[Draft, int], ...] = ()
    undone: tuple[tuple[Draft, int], ...] = ()
    version: int = 0

    def edited(self, draft: Draft, chosen: int) -> Edits:
        """Take an edit; what was undone before is gone."""
        chosen = max(0, min(chosen, len(draft.program.lines)))
        before = (*self.before, (self.draft, self.chosen))[-MOST:]
        return Edits(draft, chosen, before, (), self.version + 1)

    def undo(self) -> Edits:
        """Take the last edit back.

        Raises:
            TeachError: There is none.
        """
        if not self.before:
            raise TeachError("there is nothing to undo")
        (draft, chosen), now = self.before[-1], (self.draft, self.chosen)
        return Edits(draft, chosen, self.before[:-1], (*self.undone, now), self.version + 1)

    def redo(self) -> Edits:
        """Make the edit again that was taken back last.

        Raises:
            TeachError: There is none.
        """
        if not self.undone:
            raise TeachError("there is nothing to redo")
        (draft, chosen), now = self.undone[-1], (self.draft, self.chosen)
        return Edits(draft, chosen, (*self.before, now), self.undone[:-1], self.version + 1)
