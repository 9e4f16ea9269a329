"""Who may open a page: tokens, persons, doors; what all pages share."""
