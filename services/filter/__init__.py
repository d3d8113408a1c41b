"""Where the pad is, from many fixes."""
