"""From a source to labelled arrays in SI: formats, tables, and the rule for columns.

`files` turns a file into cells of a table or into labelled data.
`tables` turns cells into numbers with headings. `columns` holds the
rule by which a column is read. `labels` applies it to profiles, and
returns arrays in SI that state where they come from. `read_peaks` and
`read_curve` use the same files, tables and rule. These files import no
problem and no friction law.
"""
