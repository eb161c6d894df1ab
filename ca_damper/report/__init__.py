"""What comes out of a run: measures, reports, certificates, progress."""
