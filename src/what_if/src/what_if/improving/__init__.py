"""A quicker program that does the same, found in the second world.

``choices``   what of a program's text may be otherwise, and the program with it.
``finding``   which choices a program has: its speeds, corners, heights, its order of rounds.
``ways``      the same places with the table or the arm standing otherwise.
``trying``    how long a program takes, and what speaks against it.
``descent``   one choice after the other, as long as the program gets quicker.
``plants``    how long the stand-in takes, and what becomes of the parts.
``telling``   the tables: what changed and why it is quicker, and the proof.

``improve_io`` spreads the descents over the processors, ``improve_node`` is the command line.
"""
