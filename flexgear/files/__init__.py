"""Writing files and folders: whole or not at all, and never over what is somebody else's."""
