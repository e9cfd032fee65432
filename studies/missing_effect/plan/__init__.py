"""What to measure next, with a price: the cheapest further measurements that settle what a diagnosis leaves open."""
