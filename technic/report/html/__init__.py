"""The page: one self-contained HTML file with a model that turns, bends and plays its motions."""
