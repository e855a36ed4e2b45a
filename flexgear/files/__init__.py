"""Writing files and folders: whole or not at all, and never over what is somebody else's."""

STOPPING = ("SIGINT", "SIGTERM", "SIGHUP")  # Ctrl-C, job schedulers, a terminal that is closed
