"""The local nucleation criterion of Uenishi and Rice (2003), applied as a moving average."""
