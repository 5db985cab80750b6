"""Rigid or flexible, what moves, how rigid, where it is weak."""
