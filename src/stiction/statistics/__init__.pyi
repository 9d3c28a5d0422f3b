# What editors see; __init__.py imports each on first use.

from stiction.inference.agreement import agreement as agreement
