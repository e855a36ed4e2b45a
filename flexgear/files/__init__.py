"""Writing files and folders: completely or not at all, and never over files of another origin."""

STOPPING = ("SIGINT", "SIGTERM", "SIGHUP")  # Ctrl-C, job schedulers, a terminal that is closed
