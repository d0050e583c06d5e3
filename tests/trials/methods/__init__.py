"""Other people's methods on the recordings of sealed trials, a file each. See ../baselines.py."""
