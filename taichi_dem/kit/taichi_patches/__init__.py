"""Every place that replaces a part of Taichi, or calls what it does not promise, to save time.

The README beside it lists them, with what each saves.
"""
