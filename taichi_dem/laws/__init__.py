"""What acts between bodies: laws of bonds, of contact and of friction."""
