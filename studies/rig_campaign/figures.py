"""Figures of a campaign: carpet plot, stiffnesses over load, flat against drum, residuals, repeats."""

from pathlib import Path
from typing import TYPE_CHECKING

from studies.reporting.plotting import settle
from studies.rig_campaign.figure_carpet import carpet
from studies.rig_campaign.figure_recordings import pull_loop, repeats, sweep_residuals
from studies.rig_campaign.figure_stiffness import flat_against_drum, stiffness_over_load, surface_pairs
from tyre.base.files import replacing, slugs
from tyre.campaigns.campaign import Campaign
from tyre.campaigns.recording import points_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_figures(campaign: Campaign, folder: Path, *, every_recording: bool = False) -> list[Path]:
    """Draw all figures of a campaign that its data allow.

    Parameters
    ----------
    campaign : Campaign
    folder : Path
        Made if missing.
    every_recording : bool
        Also draw the residuals of every sweep and pull test, in ``residuals/``, not only of the worst.

    Returns
    -------
    list of Path
        PNG files.
    """
    import matplotlib

    folder.mkdir(parents=True, exist_ok=True)
    drawn: list[tuple[str, Figure]] = []
    with matplotlib.rc_context({"font.size": 9.0, "axes.grid": True, "grid.alpha": 0.3, "figure.dpi": 130}):
        stems = slugs(sorted({c.tyre for c in campaign.conditions}))
        for tyre, stem in stems.items():
            mine = [c for c in campaign.conditions if c.tyre == tyre]
            for surface in sorted({c.surface for c in mine}, reverse=True):
                chosen = [c for c in mine if c.surface == surface and c.sweeps]
                if chosen:
                    drawn.append((f"carpet_{stem}_{surface}", carpet(chosen)))
            drawn.append((f"stiffness_{stem}", stiffness_over_load(mine)))
            pairs = surface_pairs(mine)
            if pairs:
                drawn.append((f"flat_drum_{stem}", flat_against_drum(campaign, tyre, pairs)))
        sweeps = [item for c in campaign.conditions for item in c.sweeps]
        if sweeps:
            worst = min(sweeps, key=lambda item: (item.r_squared, item.file))
            if points_of(worst):
                drawn.append(("residuals_worst_sweep", sweep_residuals(worst)))
        pulls = [item for c in campaign.conditions for item in c.pulls]
        if pulls:
            worst = min(pulls, key=lambda item: (item.r_squared, item.file))
            if points_of(worst):
                drawn.append(("pull_worst", pull_loop(worst)))
        if campaign.sweep_repeatability.measured or campaign.pull_repeatability.measured:
            drawn.append(("repeatability", repeats(campaign)))
        paths = []
        for name, figure in drawn:
            path = folder / f"{name}.png"
            _save(figure, path)
            paths.append(path)
        if every_recording:
            (folder / "residuals").mkdir(exist_ok=True)
            of_file = {item.file: item for item in (*sweeps, *pulls)}
            for file, stem in slugs(of_file).items():
                item = of_file[file]
                figure = sweep_residuals(item) if item.kind == "slip_sweep" else pull_loop(item)
                path = folder / "residuals" / f"{stem}.png"
                _save(figure, path)
                paths.append(path)
    return paths


def _save(figure: "Figure", path: Path) -> None:
    settle(figure)
    with replacing(path) as part:
        figure.savefig(part)
