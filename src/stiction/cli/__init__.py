"""The command line, and pages that show a result.

`commands` has a function for each command. Its arguments are the
options, and its docstring is the help. `main` at the end turns errors
into messages and exit codes. `pages` writes a page about a run or a
design, with the template next to it.
"""
