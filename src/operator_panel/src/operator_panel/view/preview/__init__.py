"""A motion that is judged before it is made."""
