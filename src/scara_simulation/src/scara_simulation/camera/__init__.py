"""The camera's pure part: what it is set to, its optics, round shapes."""
