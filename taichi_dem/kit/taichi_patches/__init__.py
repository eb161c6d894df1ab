"""Every place that replaces a part of Taichi, or calls what it does not promise, to save time.

README.md in this folder lists them, with what each saves.
"""
