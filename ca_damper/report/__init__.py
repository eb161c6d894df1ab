"""Output of a run: measures, reports, certificates, progress."""
