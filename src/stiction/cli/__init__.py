"""The command line: parse, call, print; and a result as a page.

`commands` has a function for each command. Its arguments are the options, and its
docstring is the help. `main` at the end turns errors into messages and exit codes.
`report` puts text, figures and tables of a run on a page, with the template beside it,
and `design_page` does so for a design.
"""
