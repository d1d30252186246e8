"""`python -m cli`: the same command without its console script."""

from cli.app import main

main()
