"""``python -m stiction``."""

from stiction.cli.commands import main

main()
