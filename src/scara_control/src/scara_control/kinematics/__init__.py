"""Where the tool is and how it moves: screws for any arm, closed forms for the SCARA."""
