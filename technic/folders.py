"""Where the program keeps things of its own on the user's machine."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["cache_folder", "config_folder", "data_folder"]


def cache_folder() -> Path:
    """Return the folder for cached data: ``TECHNIC_CACHE`` or the user's cache folder."""
    explicit = os.environ.get("TECHNIC_CACHE")
    if explicit:
        return Path(explicit)
    import platformdirs

    return Path(platformdirs.user_cache_dir("technic-rigidity", appauthor=False))


def config_folder() -> Path:
    """Return the folder for the user's settings: ``TECHNIC_CONFIG`` or the user's folder for them."""
    explicit = os.environ.get("TECHNIC_CONFIG")
    if explicit:
        return Path(explicit)
    import platformdirs

    return Path(platformdirs.user_config_dir("technic-rigidity", appauthor=False))


def data_folder() -> Path:
    """Return the folder for data that the user fetched: ``TECHNIC_DATA`` or the user's data folder."""
    explicit = os.environ.get("TECHNIC_DATA")
    if explicit:
        return Path(explicit)
    import platformdirs

    return Path(platformdirs.user_data_dir("technic-rigidity", appauthor=False))
