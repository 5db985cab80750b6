"""From an assembly to its matrices K, J, A, S, M."""
