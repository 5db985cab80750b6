"""``python -m technic`` is the same as ``technic``."""

from technic.cli import main

if __name__ == "__main__":
    main()
