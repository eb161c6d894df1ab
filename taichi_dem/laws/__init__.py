"""Laws between bodies: of bonds, contact and friction."""
