"""What editors ask: a pure core over texts and positions, and a thin shell that speaks the Language Server Protocol.

Positions of the core count lines and characters from 0; the shell turns them into the units of the protocol.
"""
