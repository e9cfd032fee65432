"""What a report of a diagnosis says beyond the verdict, and in which words."""
