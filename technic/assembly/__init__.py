"""What is joined to what: parts in their places, joints between them, supports."""
