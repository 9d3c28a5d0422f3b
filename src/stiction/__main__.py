"""The command line as ``python -m stiction``.

Python looks for modules in the current folder first,
and its files may come from a stranger. Therefore the
current folder is removed from the path. The command
``stiction`` does not search the current folder either.
"""

import os
import sys

if not sys.flags.safe_path and sys.path[:1] in ([""], [os.getcwd()]):
    del sys.path[0]

from stiction.cli.commands import main

main()
