"""Step responses of the twin's joint controllers, as in the Figures 8 to 10 of the article."""
