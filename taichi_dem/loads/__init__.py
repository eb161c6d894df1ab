"""What acts on a body: loads, supports, ground."""
