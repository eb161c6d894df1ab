"""Output of a run: time series, frames and files."""
