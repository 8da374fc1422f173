"""The expression language: tokens, trees, types, static checks, evaluation."""
