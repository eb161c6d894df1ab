"""Progress of compiling and running: what is reported, and the bar that shows it."""
