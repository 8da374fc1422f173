"""What commands write: answers on stdout, what is wrong on stderr."""
