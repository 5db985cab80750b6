"""Move the joints of a linkage so that it becomes as rigid as it can be with little change."""
