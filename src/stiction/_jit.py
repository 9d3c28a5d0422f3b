import sys

import stiction.jit

sys.modules[__name__] = stiction.jit
