"""Root loci in any parameter."""
