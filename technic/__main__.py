"""``python -m technic`` is the command ``technic``."""

from __future__ import annotations

from technic.cli import main

if __name__ == "__main__":
    main()
