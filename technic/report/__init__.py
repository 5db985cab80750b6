"""What a person or another program reads: text, JSON, pictures."""
