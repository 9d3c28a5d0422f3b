"""The study of Albertini et al. (2020), recomputed with public names of `stiction` only."""
