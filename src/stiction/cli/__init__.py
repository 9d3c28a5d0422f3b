"""The command line: parse, call, print; and a result as a page."""
