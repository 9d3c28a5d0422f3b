import sys

import stiction.arrays

sys.modules[__name__] = stiction.arrays
