"""``python -m stiction``."""

from stiction.cli import main

main()
