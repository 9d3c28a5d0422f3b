import sys

import stiction.friction.laws

sys.modules[__name__] = stiction.friction.laws
