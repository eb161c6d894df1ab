"""Tables and state of a scene on the device."""
