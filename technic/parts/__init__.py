"""What a part is: its ports, its body, its shape and its material."""
