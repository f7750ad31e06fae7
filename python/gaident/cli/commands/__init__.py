"""The commands, a module each; gaident/cli/main.py says which name calls which."""
