import sys

import stiction.problem

sys.modules[__name__] = stiction.problem
