"""The mechanics, on any kind of number: closed forms, positions, rates, loads and their paths, effort, reactions."""
