"""A fitted campaign as report, figures and files, from recordings in any format."""

from tyre.ground.door import door

HOMES = dict.fromkeys(("save_figures", "stiffness_over_load"), "studies.rig_campaign.figures")
HOMES |= dict.fromkeys(("campaign_table", "report_text", "write_campaign"), "studies.rig_campaign.report")
__getattr__, __dir__ = door(__name__, HOMES)
