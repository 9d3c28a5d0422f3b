import sys

import stiction.files

sys.modules[__name__] = stiction.files
