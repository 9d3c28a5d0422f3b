"""``python -m stiction``.

Python looks for modules in the current folder first, whose files may come from a stranger. The
command ``stiction`` has no such entry in its path.
"""

import os
import sys

if not sys.flags.safe_path and sys.path[:1] in ([""], [os.getcwd()]):
    del sys.path[0]

from stiction.cli.commands import main

main()
