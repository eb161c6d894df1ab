"""What a run leaves behind: series, frames, files and the result."""
