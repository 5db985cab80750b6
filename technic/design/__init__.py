"""What to change: new parts, other geometry."""
