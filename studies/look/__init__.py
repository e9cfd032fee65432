"""Look at a recording: what it holds, what each command would make of it, and what is missing."""

from tyre.ground.door import room

HOME = {
    "draft_files": ("Draft", "drafts", "stems", "steps", "write_drafts"),
    "overview": ("Look", "draw", "look", "print_look"),
    "several": ("recordings_of", "print_looks"),
    "rig_uses": ("USES", "Event", "Use"),
}
"""Module -> the names that it gives to other rooms; each is imported when it is first used."""

__getattr__, __dir__ = room(__name__, HOME)
