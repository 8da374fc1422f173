"""Requests of editors: a pure core over texts and positions, and a thin shell for the Language Server Protocol.

Positions of the core count lines and characters from 0; the shell turns them into the units of the protocol.
"""
