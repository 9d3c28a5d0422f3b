import sys

import stiction.progress

sys.modules[__name__] = stiction.progress
