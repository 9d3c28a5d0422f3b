"""The command line: parse, call, print; and a result as a page.

`commands` has a function for each command, whose arguments are its options and whose docstring is
its help; `main` at its end turns errors into messages and exit codes. `report` puts text, figures
and tables of a run on one page, by the template beside it.
"""
