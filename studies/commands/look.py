"""``velotyre look``: what is in a recording, what each command would do with it, and what is lacking."""

from pathlib import Path

import click

from studies.command_options import PATH
from studies.reporting.command_context import example


@click.command(
    help="Show what is in recordings (any format) and what can be done with them: channels, faults, usable samples.",
    epilog=example("velotyre look rig0815.csv --out look"),
)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=PATH)
@click.option(
    "--channels", "channels_file", type=PATH, metavar="MAP.toml",
    help="Which column is which channel; without, the sidecar's map, else guesses.",
)  # fmt: skip
@click.option("--dbc", type=PATH, multiple=True, help="Database that decodes CAN frames.")
@click.option("--out", type=PATH, metavar="DIR", help="Write pictures and drafts there.")
@click.option("--json", "json_file", metavar="FILE", help="Write JSON here; - is standard output.")
@click.option("--force", is_flag=True, help="Overwrite drafts that are there already.")
def command(
    files: tuple[Path, ...], channels_file: Path | None, dbc: tuple[Path, ...], out: Path | None, json_file: str | None,
    *, force: bool,
) -> None:  # fmt: skip
    from contextlib import nullcontext

    from studies.channel_options import chosen_map
    from studies.look import drafts, draw, look, stems, steps, tell, write_drafts
    from studies.reporting.manifest import results
    from studies.reporting.output import write_json
    from tyre.errors import InputError

    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file; give a folder")
    channel_map = chosen_map(channels_file, ())
    looks, failed = [], []
    for path in files:
        try:
            looks.append(look(path, channel_map, dbc))
        except InputError as error:
            if len(files) == 1:
                raise
            failed.append(str(error))
    with nullcontext() if out is None else results(out):
        called = stems([found.opened.path for found in looks])
        for place, (found, stem) in enumerate(zip(looks, called, strict=True)):
            made, lines = drafts(found, out or Path(), stem), []
            if out is not None:
                written = write_drafts(made, out, force=force)
                lines = ["", f"picture: {draw(found, out / f'{stem}.look')}"]
                for path, draft in zip(written, made, strict=True):
                    marks = f", {draft.marks} place{'s' * (draft.marks > 1)} to fill in" if draft.marks else ""
                    lines.append(f"draft: {path} ({draft.purpose}{marks})")
            if json_file != "-":
                click.echo("\n" * (place > 0), nl=False)
                tell(found, steps(found, made, out))
                click.echo("\n".join([*lines, ""]) if lines else "", nl=False)
    if json_file:
        write_json({"files": [found.as_json() for found in looks]}, json_file)
    if failed:
        raise InputError("; ".join(failed))
