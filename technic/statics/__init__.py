"""Static answers: how far a model gives way under loads."""
