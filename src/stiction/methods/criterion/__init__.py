"""The local criterion of Uenishi and Rice (2003), as a moving average of strength over load."""
