"""``python -m flexgear``: the command, where its script is not on the path."""

from flexgear.cli import main

if __name__ == "__main__":
    main()
