"""``velotyre look``: what is in a recording, what each command would do with it, and what is missing."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from studies.model_space.command_options import PATH
from studies.reporting.command_context import example

if TYPE_CHECKING:
    from studies.look.draft_files import Draft


@click.command(
    help="Show what recordings contain and can be used for. Channels, faults, usable samples and next commands, "
    "for any format.",
    epilog=example("velotyre look rig0815.csv --out look"),
)
@click.argument("files", nargs=-1, required=True, metavar="FILE|FOLDER...", type=PATH)
@click.option(
    "--channels",
    "channels_file",
    type=PATH,
    metavar="MAP.toml",
    help="Channel map; default: the map of the sidecar, else guesses.",
)
@click.option("--dbc", type=PATH, multiple=True, help="Database that decodes CAN frames; may be repeated.")
@click.option("--out", type=PATH, metavar="DIR", help="Folder for pictures and draft files.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
@click.option("--force", is_flag=True, help="Overwrite existing drafts.")
def command(
    files: tuple[Path, ...],
    channels_file: Path | None,
    dbc: tuple[Path, ...],
    out: Path | None,
    json_file: str | None,
    *,
    force: bool,
) -> None:
    from contextlib import nullcontext

    from studies.look import drafts, draw, look, print_look, print_looks, recordings_of, stems, steps, write_drafts
    from studies.model_space.channel_options import chosen_map
    from studies.reporting.manifest import results
    from studies.reporting.output import write_json
    from tyre.formats import FORMATS
    from tyre.ground.errors import InputError

    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file; give a folder")
    channel_map = chosen_map(channels_file, ())
    looks = []
    failures: list[str] = []
    paths = recordings_of(files)
    if not paths:
        raise InputError(f"{files[0]}: no file in this folder ends like a recording ({', '.join(FORMATS)})")
    for path in paths:
        try:
            looks.append(look(path, channel_map, dbc))
        except InputError as error:
            if len(paths) == 1:
                raise
            if path in files:
                failures.append(str(error))
            else:  # a folder may hold what is no recording
                click.echo(f"note: {error}", err=True)
    with nullcontext() if out is None else results(out):
        all_steps = []
        all_written: list[str] = []
        for recording, stem in zip(looks, stems([recording.opened.path for recording in looks]), strict=True):
            recording_drafts = drafts(recording, out or Path(), stem)
            lines: list[str] = []
            if out is not None:
                written = write_drafts(recording_drafts, out, force=force)
                lines = ["", f"picture: {draw(recording, out / f'{stem}.look')}"]
                lines += [_describe_draft(path, draft) for path, draft in zip(written, recording_drafts, strict=True)]
                all_written += [str(path) for path in written]
            all_steps.append(steps(recording, recording_drafts, out))
            if json_file != "-" and len(looks) == 1:
                print_look(recording, all_steps[-1])
                click.echo("\n".join([*lines, ""]) if lines else "", nl=False)
        if json_file != "-" and len(looks) > 1:
            print_looks(looks, all_steps, all_written)
    if json_file:
        write_json({"files": [recording.as_json() for recording in looks]}, json_file)
    if failures:
        raise InputError("; ".join(failures))


def _describe_draft(path: Path, draft: "Draft") -> str:
    """Say where a draft is, what for, and how many places are to be filled in."""
    marks = ""
    if draft.marks:
        marks = f", {draft.marks} {'places' if draft.marks > 1 else 'place'} to fill in"
    return f"draft: {path} ({draft.purpose}{marks})"
