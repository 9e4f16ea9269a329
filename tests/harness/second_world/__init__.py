"""Random programs with and without a planted harm, and what outside libraries say of them."""
