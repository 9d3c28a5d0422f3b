import sys

import stiction.model

sys.modules[__name__] = stiction.model
