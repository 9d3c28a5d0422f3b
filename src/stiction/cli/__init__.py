"""The command line, and pages that show a result.

`commands` has a function for each command. Its arguments are the options, and its
docstring is the help. `main` at the end turns errors into messages and exit codes.
`report` writes a page with text, figures and tables of a run, with the template
next to it. `design_page` writes a page for a design.
"""
