"""Everything that a user runs: the main study, root loci, sweeps and the command line. No physics lives here."""
