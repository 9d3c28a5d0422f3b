import sys

import stiction.lanes

sys.modules[__name__] = stiction.lanes
