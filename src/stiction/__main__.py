"""``python -m stiction``."""

from stiction.cli.app import main

main()
