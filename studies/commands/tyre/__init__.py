"""From rig recordings and measured tables to tyre properties."""
