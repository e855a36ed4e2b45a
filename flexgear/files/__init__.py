"""Reading and writing files: results, caches, loads, matrices and REXS models."""

STOP_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")  # of Ctrl-C, job schedulers, a closed terminal
