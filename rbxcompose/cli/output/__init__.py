"""The output of commands: answers on stdout, errors on stderr."""
