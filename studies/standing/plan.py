"""The sheet for half an hour at the front frame: what to hold, where to hang, where to put the phone."""

from studies.reporting.markdown_text import render_file


def plan(bicycle: str) -> str:
    """The sheet as a terminal shows it, with the name or file of a ``bicycle`` in the measurement file."""
    return render_file("studies.standing", "plan.txt.j2", {"bicycle": bicycle}, escaped=False).strip()
