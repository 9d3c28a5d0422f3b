"""An explorer of one kind of interface, in a browser on the same machine.

`setting.py` says what can be moved and what follows from it, without a browser; `page.py` shows it.
"""
