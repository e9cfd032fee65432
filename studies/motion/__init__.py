"""What a rider would see: time histories, mode shapes and films."""
