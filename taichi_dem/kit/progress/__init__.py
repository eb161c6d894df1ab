"""Progress of compiling and running: reports, and the bar that shows them."""
