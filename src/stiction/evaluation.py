import sys

import stiction.methods

sys.modules[__name__] = stiction.methods
