"""Figure style, tables and the HTML report."""
